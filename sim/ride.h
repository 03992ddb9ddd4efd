// How an axis travels: a function of time, so that nothing runs while nobody looks.
#pragma once

#include <cstdint>

#include "sim/state_file.h"
#include "sim/world.h"

namespace rig::sim {

/// Where the axis is at a time (nanoseconds since 1970).
[[nodiscard]] double axis_position(const AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns);
/// Speed there, at least 0.
[[nodiscard]] double axis_speed(const AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns);
[[nodiscard]] bool axis_moving(const AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns);

/// From rest to rest with a trapezoid of speed, or a triangle where the way is too short to reach `velocity`.
/// An axis under way brakes first. The hard stops end a move that is meant to go further.
void begin_move(AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns, double target_rad,
                double velocity_rad_s, double acceleration_rad_s2);

/// Brakes with the acceleration of the move and forgets what was to follow.
void begin_brake(AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns);

/// Stands still at once, on the nearest count: the drive has lost its power and its brake falls in.
void cut_short(AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns);

/// Brings the record up to a time: a braking that has ended gives way to the move behind it. Changes nothing
/// that the other functions answer.
void settle(AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns);

}  // namespace rig::sim
