#include "daemon/exposing.h"

#include <algorithm>

#include "daemon/safety.h"

namespace rig::daemon {

using base::seconds;

namespace {

constexpr double kFramePatience_s = 10;  // beyond exposure and readout
constexpr double kTriggerPatience = 4;   // of the camera's deadline: other calls to it may come first
constexpr double kTriggerAgain_s = 0.05;

void send_trigger(const Setup& setup, State& state, Actions& actions) {
  PendingFrame& frame = *state.frame;
  frame.again.reset();
  frame.answer_by = state.now + seconds(kTriggerPatience * setup.rig.deadlines.camera_s);
  actions.push_back(TriggerCamera{frame.exposure_s, frame.exposure});
}

// From now on.
double lasts_s(const Setup& setup, double exposure_s) {
  return exposure_s + setup.camera.readout_s;
}

}  // namespace

void trigger_camera(const Setup& setup, State& state, Actions& actions, double exposure_s, std::int64_t row,
                    int index) {
  PendingFrame frame;
  // What the camera was asked before this rigd began is not known.
  if (state.last_exposure == 0)
    state.camera_free = state.now + seconds(lasts_s(setup, setup.rig.camera.max_exposure_s));
  frame.exposure = ++state.last_exposure;
  frame.row = row;
  frame.index = index;
  frame.exposure_s = exposure_s;
  frame.busy_until = std::max(state.now, state.camera_free) + seconds(setup.rig.deadlines.camera_s);
  // Also where it is not heard of any more that the camera took it.
  state.camera_free = std::max(state.camera_free, state.now + seconds(lasts_s(setup, exposure_s)));
  state.frame = frame;
  send_trigger(setup, state, actions);
}

void on_camera_triggered(const Setup& setup, State& state, const CameraTriggered& event) {
  if (!state.frame || state.frame->exposure != event.exposure || state.frame->exposing) return;
  PendingFrame& frame = *state.frame;
  frame.exposing = true;
  frame.exposed = state.now + seconds(frame.exposure_s);
  frame.fetch_at = state.now + seconds(lasts_s(setup, frame.exposure_s));
  frame.deadline = frame.fetch_at + seconds(kFramePatience_s);
  state.camera_free = frame.fetch_at;
}

void on_camera_busy(const Setup& setup, State& state, Actions& actions, const CameraBusy& event) {
  if (!state.frame || state.frame->exposure != event.exposure || state.frame->exposing) return;
  if (state.now >= state.frame->busy_until) {
    stop_everything(setup, state, actions, "the camera takes no trigger: " + event.what);
    return;
  }
  state.frame->again = state.now + seconds(kTriggerAgain_s);
}

void trigger_again(const Setup& setup, State& state, Actions& actions) {
  if (state.frame && state.frame->again && state.now >= *state.frame->again)
    send_trigger(setup, state, actions);
}

bool is_exposed(const State& state) {
  return state.frame && state.frame->exposing && state.now >= state.frame->exposed;
}

}  // namespace rig::daemon
