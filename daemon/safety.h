// The rules that no command and no fault may break, in one place.
#pragma once

#include <string>

#include "core/base/result.h"
#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Whether these axes may be sent to these angles now: no stop latched, everything homed and known, within
/// the limits, out of the keep-out zones all the way. Axes that are not involved count where they stand.
[[nodiscard]] base::Result<void> may_move(const Setup& setup, const State& state,
                                          const std::array<bool, kAxisCount>& involved,
                                          const JointAngles& target_rad);

/// Commands every axis to stop. Where those that may be moving stand is unknown until they are read at rest.
void stop_axes(State& state, Actions& actions);

/// Stops every axis, makes the light safe, ends the exposure, and answers whoever waits for any of it.
void drop_all(const Setup& setup, State& state, Actions& actions, const std::string& reason);

/// Stops every axis, makes the light safe, drops what was under way, and latches the reason until someone
/// clears it. Stopping again only repeats the stop actions.
void stop_everything(const Setup& setup, State& state, Actions& actions, const std::string& reason);

/// Ends the latch; an Error while its cause persists.
[[nodiscard]] base::Result<void> clear_stop(State& state, Actions& actions);

}  // namespace rig::daemon
