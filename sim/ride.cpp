#include "sim/ride.h"

#include <algorithm>
#include <cmath>

namespace rig::sim {

namespace {

// The way of one move or one braking, from its start.
struct Ride {
  double distance = 0;   // from start to end, at least 0
  double direction = 1;  // +1 or -1
  double velocity = 0;   // highest speed
  double acceleration = 0;
  double ramp_s = 0;  // of speeding up, and of slowing down again
  double total_s = 0;
  bool braking = false;  // starts at `velocity` and slows down from there

  Ride(const AxisMemory& axis, const AxisWorld& world) {
    const double way = static_cast<double>(axis.to) * world.resolution_rad - axis.from_rad;
    distance = std::abs(way);
    direction = way < 0 ? -1 : 1;
    velocity = axis.velocity_rad_s;
    acceleration = axis.acceleration_rad_s2;
    braking = axis.braking != 0;
    if (distance <= 0 || velocity <= 0 || acceleration <= 0) return;
    if (braking) {
      total_s = velocity / acceleration;
      return;
    }
    velocity = std::min(velocity, std::sqrt(distance * acceleration));
    ramp_s = velocity / acceleration;
    total_s = ramp_s + distance / velocity;
  }

  [[nodiscard]] double travelled(double t) const {
    if (t >= total_s) return distance;
    if (t <= 0) return 0;
    if (braking) return std::min(distance, velocity * t - 0.5 * acceleration * t * t);
    if (t < ramp_s) return 0.5 * acceleration * t * t;
    const double left_s = total_s - t;
    if (left_s > ramp_s) return velocity * (t - 0.5 * ramp_s);
    return distance - 0.5 * acceleration * left_s * left_s;
  }

  [[nodiscard]] double speed(double t) const {
    if (t <= 0 || t >= total_s) return 0;
    const double slowing = acceleration * (total_s - t);
    return braking ? slowing : std::min({acceleration * t, velocity, slowing});
  }
};

double since_start_s(const AxisMemory& axis, std::int64_t now_ns) {
  return 1e-9 * static_cast<double>(now_ns - axis.start_ns);
}

// Puts a move into the record of an axis at rest.
void set_off(AxisMemory& axis, std::int64_t start_ns, double from_rad, std::int64_t from, std::int64_t to,
             double velocity_rad_s, double acceleration_rad_s2) {
  axis.from_rad = from_rad;
  axis.to = to;
  axis.start_ns = start_ns;
  axis.velocity_rad_s = velocity_rad_s;
  axis.acceleration_rad_s2 = acceleration_rad_s2;
  axis.braking = 0;
  axis.again = 0;
  if (to != from) axis.from_above = to < from ? 1 : 0;
}

AxisMemory settled(AxisMemory axis, const AxisWorld& world, std::int64_t now_ns) {
  settle(axis, world, now_ns);
  return axis;
}

}  // namespace

void settle(AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns) {
  const Ride ride(axis, world);
  if (axis.again == 0 || since_start_s(axis, now_ns) < ride.total_s) return;
  set_off(axis, axis.start_ns + std::llround(1e9 * ride.total_s),
          static_cast<double>(axis.to) * world.resolution_rad, axis.to, axis.next, axis.next_velocity_rad_s,
          axis.next_acceleration_rad_s2);
}

double axis_position(const AxisMemory& memory, const AxisWorld& world, std::int64_t now_ns) {
  const AxisMemory axis = settled(memory, world, now_ns);
  const Ride ride(axis, world);
  const double t = since_start_s(axis, now_ns);
  // At rest exactly on a count, without the rounding of a sum.
  if (t >= ride.total_s) return static_cast<double>(axis.to) * world.resolution_rad;
  return axis.from_rad + ride.direction * ride.travelled(t);
}

double axis_speed(const AxisMemory& memory, const AxisWorld& world, std::int64_t now_ns) {
  const AxisMemory axis = settled(memory, world, now_ns);
  return Ride(axis, world).speed(since_start_s(axis, now_ns));
}

bool axis_moving(const AxisMemory& memory, const AxisWorld& world, std::int64_t now_ns) {
  const AxisMemory axis = settled(memory, world, now_ns);
  return since_start_s(axis, now_ns) < Ride(axis, world).total_s;
}

void begin_move(AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns, double target_rad,
                double velocity_rad_s, double acceleration_rad_s2) {
  const std::int64_t target = counts_of(world, std::clamp(target_rad, world.low_rad, world.high_rad));
  const double velocity = std::min(velocity_rad_s, world.max_velocity_rad_s);
  const double acceleration = std::min(acceleration_rad_s2, world.max_acceleration_rad_s2);
  begin_brake(axis, world, now_ns);
  if (axis_moving(axis, world, now_ns)) {
    axis.again = 1;
    axis.next = target;
    axis.next_velocity_rad_s = velocity;
    axis.next_acceleration_rad_s2 = acceleration;
    return;
  }
  const double here = axis_position(axis, world, now_ns);
  set_off(axis, now_ns, here, counts_of(world, here), target, velocity, acceleration);
}

void begin_brake(AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns) {
  settle(axis, world, now_ns);
  axis.again = 0;
  if (axis.braking != 0 || !axis_moving(axis, world, now_ns)) return;
  const double speed = axis_speed(axis, world, now_ns);
  const double here = axis_position(axis, world, now_ns);
  const double rest = 0.5 * speed * speed / axis.acceleration_rad_s2;
  const double direction = static_cast<double>(axis.to) * world.resolution_rad < here ? -1 : 1;
  axis.from_rad = here;
  axis.to = counts_of(world, here + direction * rest);
  axis.start_ns = now_ns;
  axis.velocity_rad_s = speed;
  axis.braking = 1;
}

void cut_short(AxisMemory& axis, const AxisWorld& world, std::int64_t now_ns) {
  settle(axis, world, now_ns);
  axis.again = 0;
  if (!axis_moving(axis, world, now_ns)) return;
  axis.to = counts_of(world, axis_position(axis, world, now_ns));
  axis.from_rad = static_cast<double>(axis.to) * world.resolution_rad;
  axis.start_ns = now_ns;
  axis.braking = 0;
}

}  // namespace rig::sim
