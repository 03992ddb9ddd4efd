#include "daemon/lamp.h"

#include <algorithm>

namespace rig::daemon {

void note_lamp(State& state, const drivers::LightState& now) {
  if (now.on) {
    state.lamp_out_since.reset();
  } else if (!state.lamp_out_since) {
    state.lamp_out_since = state.now;
  }
}

double cool_down_left_s(const Setup& setup, const State& state) {
  if (setup.rig.light.cool_down_s <= 0 || (state.light_known && state.light.on)) return 0;
  if (!state.lamp_out_since) return setup.rig.light.cool_down_s;  // not yet looked at
  return std::max(0.0, setup.rig.light.cool_down_s - base::to_seconds(state.now - *state.lamp_out_since));
}

bool light_for_job(const Setup& setup, State& state, Actions& actions) {
  if (!state.job->lamp_asked && cool_down_left_s(setup, state) <= 0) {
    actions.push_back(SetLightLevel{1});
    state.job->lamp_asked = true;
  }
  return state.job->lamp_asked;
}

void make_light_safe(const Setup& setup, Actions& actions) {
  if (setup.light.has_shutter) {
    actions.push_back(SetShutter{false});
  } else {
    actions.push_back(SetLightLevel{setup.rig.light.safe_level});
  }
}

}  // namespace rig::daemon
