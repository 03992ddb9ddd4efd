// The rules of the lamp in one place: a discharge lamp must not be lit again while it is hot, and a light
// without a shutter goes to a stated level where everything stops.
#pragma once

#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Takes in a reading: since when the lamp is out.
void note_lamp(State& state, const drivers::LightState& now);

/// Seconds until the lamp may be lit; 0 where it burns or has cooled down. One that was out when rigd started
/// counts as put out at that moment: nobody knows better.
[[nodiscard]] double cool_down_left_s(const Setup& setup, const State& state);

/// Full level for the active job, once the lamp has cooled down; asked again later where it has not yet.
/// True: it was lit now, or had been.
bool light_for_job(const Setup& setup, State& state, Actions& actions);

/// Shutter closed; without one, the light's safe level ([light] safe_level). Always allowed.
void make_light_safe(const Setup& setup, Actions& actions);

}  // namespace rig::daemon
