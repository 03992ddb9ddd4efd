// Whether a moving axis is where its move should have brought it by now.
#pragma once

#include <string>

#include "daemon/state.h"

namespace rig::daemon {

/// Why this reading, taken during the move under way, is not of an axis that follows it: it stands or goes
/// elsewhere than predicted by more than its following_deg. A reading may be as old as the deadline of an
/// axis' call, and the move may have begun as late. Empty: it follows.
[[nodiscard]] std::string off_its_way(const Setup& setup, const State& state, std::size_t axis,
                                      const drivers::AxisState& reading);

}  // namespace rig::daemon
