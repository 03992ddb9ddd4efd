// Homing and coordinated moves: legs, predicted ends, proof of arrival.
#pragma once

#include <optional>
#include <string>

#include "core/base/result.h"
#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// How long homing an axis may take: over its whole travel, since where it stands is not known, at the
/// reduced speed, or at the drive's own where that is slower.
[[nodiscard]] double homing_time_s(const Setup& setup, std::size_t axis);

/// Whether every axis is, as last read.
[[nodiscard]] bool all_homed(const State& state);

/// Starts to home these axes one after the other.
void begin_homing(const Setup& setup, State& state, Actions& actions, std::vector<std::size_t> axes,
                  std::optional<Asker> asker);

/// Starts a coordinated move after may_move allowed it; an Error, and nothing started, where it did not.
[[nodiscard]] base::Result<void> begin_move(const Setup& setup, State& state, Actions& actions,
                                            const std::array<bool, kAxisCount>& involved,
                                            const JointAngles& target_rad, std::optional<Asker> asker);

/// Moves one axis that is not homed by so much, at its reduced speed, after may_jog allowed it; an Error, and
/// nothing started, where it did not.
[[nodiscard]] base::Result<void> begin_jog(const Setup& setup, State& state, Actions& actions,
                                           std::size_t axis, double by_rad, std::optional<Asker> asker);

/// What became of a motion.
struct MotionEnd {
  std::optional<Asker> asker;
  Motion::Kind kind = Motion::Kind::move;
  std::string failure;   ///< empty: arrived, and proven so
  bool refused = false;  ///< nothing was done
};

/// Takes in a reading. Returns the end of the motion if this reading ended it; stops everything on a fault
/// and when a deadline has passed.
[[nodiscard]] std::optional<MotionEnd> on_axis_polled(const Setup& setup, State& state, Actions& actions,
                                                      const AxisPolled& polled);

/// Takes in that a driver will not do a jog: that is its end, and no fault.
[[nodiscard]] std::optional<MotionEnd> on_jog_refused(State& state, const JogRefused& refused);

/// Asks for readings when they are due; stops everything where an answer does not come.
void poll_motion(const Setup& setup, State& state, Actions& actions);

/// Whether some axis has been asked where it is and has not answered.
[[nodiscard]] bool answers_awaited(const Motion& motion);

}  // namespace rig::daemon
