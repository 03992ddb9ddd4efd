// Whether a moving axis is where its move should have brought it by now.
#pragma once

#include <string>

#include "daemon/state.h"

namespace rig::daemon {

/// Why this reading, taken during the move under way, is not of an axis that follows it: it stands or goes
/// elsewhere than predicted by more than its following_deg, or it ran into a limit switch. A reading may be
/// as old as the deadline of an axis' call, and the move may have begun as late. Empty: it follows.
[[nodiscard]] std::string off_its_way(const Setup& setup, const State& state, std::size_t axis,
                                      const drivers::AxisState& reading);

/// Why an axis may not leave for a target because of the limit switch that it stands on: further in is
/// refused, out is allowed. Empty: it may.
[[nodiscard]] std::string blocked_by_switch(const Setup& setup, const State& state, std::size_t axis,
                                            double target_rad);

}  // namespace rig::daemon
