// One exposure from the trigger to the moment its frame may be asked for.
#pragma once

#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Triggers the camera for a frame that state.frame then waits for. `row` is -1 for a snap.
void trigger_camera(const Setup& setup, State& state, Actions& actions, double exposure_s, std::int64_t row,
                    int index);

/// The camera has taken the trigger: only from here on it is known when the exposure ends, because the call
/// may have waited for its turn or for a slow camera. One of an exposure that was stopped is ignored.
void on_camera_triggered(const Setup& setup, State& state, const CameraTriggered& event);

/// The camera is still at an exposure before, one that was aborted perhaps: it is triggered again in a
/// moment. Once that exposure and its readout must be over it is a fault, and everything stops.
void on_camera_busy(const Setup& setup, State& state, Actions& actions, const CameraBusy& event);

/// Triggers again when that is due.
void trigger_again(const Setup& setup, State& state, Actions& actions);

/// Whether the light is let in no longer: the rig may move.
[[nodiscard]] bool is_exposed(const State& state);

}  // namespace rig::daemon
