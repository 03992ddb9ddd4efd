// The rules that no command and no fault may break, in one place.
#pragma once

#include <string>

#include "core/base/result.h"
#include "core/base/units.h"
#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Whether these axes may be sent to these angles now: no stop latched, everything homed and known, within
/// the limits, out of the keep-out zones all the way. Axes that are not involved count where they stand.
[[nodiscard]] base::Result<void> may_move(const Setup& setup, const State& state,
                                          const std::array<bool, kAxisCount>& involved,
                                          const JointAngles& target_rad);

/// What a drive says of its axis together with what the axis' limit lines say: a limit is active where either
/// says so. Everything else looks at no limit line itself.
[[nodiscard]] drivers::AxisState with_limit_lines(const State& state, std::size_t axis,
                                                  drivers::AxisState reading);

/// Whether every limit line was read lately; an Error that names one that was not. What is not known is not
/// taken for free.
[[nodiscard]] base::Result<void> limit_lines_known(const Setup& setup, const State& state);

/// Why this reading, taken during the move under way, must end it: the axis ran into a limit switch, be it
/// the drive's or that of a limit line. Empty: it did not, or it moves out of one.
[[nodiscard]] std::string ran_into_switch(const Setup& setup, const State& state, std::size_t axis,
                                          const drivers::AxisState& reading);

/// Why an axis may not leave for a target because of the limit switch that it stands on: further in is
/// refused, out is allowed. Empty: it may.
[[nodiscard]] std::string blocked_by_switch(const Setup& setup, const State& state, std::size_t axis,
                                            double target_rad);

/// The most that one jog may be: further than a person needs to see which way an axis turns, less than what
/// brings it far.
inline constexpr double kMostJog_rad = base::radians(10);

/// Whether this axis, which is not homed, may be moved by so much from where it stands, at its reduced speed:
/// no stop latched, everything read and at rest, no fault, not further into a limit switch, at most
/// kMostJog_rad and the axis' own travel. Where it stands is not known, so that no limit and no keep-out zone
/// can be kept: a person has to look.
[[nodiscard]] base::Result<void> may_jog(const Setup& setup, const State& state, std::size_t axis,
                                         double by_rad);

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
