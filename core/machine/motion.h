// How long moves take: trapezoidal velocity profiles, known in advance.
#pragma once

#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

/// Seconds for a move of `distance_rad` from rest to rest.
[[nodiscard]] double travel_time_s(double distance_rad, double max_velocity_rad_s,
                                   double max_acceleration_rad_s2);

/// Position, as a share 0 .. 1 of the distance, `t_s` after the start of such a move.
[[nodiscard]] double travel_share(double distance_rad, double max_velocity_rad_s,
                                  double max_acceleration_rad_s2, double t_s);

/// The legs of one axis' way to its target: a single one, or first to approach_rad below the target so that
/// the last leg always comes from below (backlash). The first leg stays within the limits.
struct AxisLegs {
  bool has_detour = false;
  double detour_rad = 0;
  double target_rad = 0;
};
[[nodiscard]] AxisLegs plan_legs(const AxisConfig& axis, double from_rad, double to_rad);

/// Seconds until all axes, moving together with their detours, stand at `to` and have settled.
[[nodiscard]] double pose_change_time_s(const RigConfig& rig, const JointAngles& from, const JointAngles& to);

}  // namespace rig::machine
