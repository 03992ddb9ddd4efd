#include "daemon/exposing.h"

namespace rig::daemon {

using base::seconds;

namespace {

constexpr double kFramePatience_s = 10;  // beyond exposure and readout
constexpr double kTriggerPatience = 4;   // of the camera's deadline: other calls to it may come first

}  // namespace

void trigger_camera(const Setup& setup, State& state, Actions& actions, double exposure_s, std::int64_t row,
                    int index) {
  PendingFrame frame;
  frame.exposure = ++state.last_exposure;
  frame.row = row;
  frame.index = index;
  frame.exposure_s = exposure_s;
  frame.answer_by = state.now + seconds(kTriggerPatience * setup.rig.deadlines.camera_s);
  state.frame = frame;
  actions.push_back(TriggerCamera{exposure_s, frame.exposure});
}

void on_camera_triggered(const Setup& setup, State& state, const CameraTriggered& event) {
  if (!state.frame || state.frame->exposure != event.exposure || state.frame->exposing) return;
  PendingFrame& frame = *state.frame;
  frame.exposing = true;
  frame.exposed = state.now + seconds(frame.exposure_s);
  frame.fetch_at = frame.exposed + seconds(setup.camera.readout_s);
  frame.deadline = frame.fetch_at + seconds(kFramePatience_s);
}

bool is_exposed(const State& state) {
  return state.frame && state.frame->exposing && state.now >= state.frame->exposed;
}

}  // namespace rig::daemon
