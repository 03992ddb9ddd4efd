#include "core/machine/motion.h"

#include <algorithm>
#include <cmath>

namespace rig::machine {

namespace {

// A trapezoid, or a triangle where the distance is too short to reach full speed.
struct Profile {
  double ramp_s;
  double cruise_s;
  double peak_rad_s;
};

Profile profile(double distance_rad, double velocity, double acceleration) {
  const double distance = std::abs(distance_rad);
  const double ramp_distance = velocity * velocity / acceleration;  // both ramps together
  if (distance < ramp_distance) {
    const double peak = std::sqrt(distance * acceleration);
    return {peak / acceleration, 0, peak};
  }
  return {velocity / acceleration, (distance - ramp_distance) / velocity, velocity};
}

}  // namespace

double travel_time_s(double distance_rad, double max_velocity_rad_s, double max_acceleration_rad_s2) {
  const Profile p = profile(distance_rad, max_velocity_rad_s, max_acceleration_rad_s2);
  return 2 * p.ramp_s + p.cruise_s;
}

double travel_share(double distance_rad, double max_velocity_rad_s, double max_acceleration_rad_s2,
                    double t_s) {
  const double distance = std::abs(distance_rad);
  const Profile p = profile(distance, max_velocity_rad_s, max_acceleration_rad_s2);
  const double total = 2 * p.ramp_s + p.cruise_s;
  if (t_s >= total) return 1;
  if (t_s <= 0) return 0;
  double done = 0;
  if (t_s < p.ramp_s) {
    done = 0.5 * max_acceleration_rad_s2 * t_s * t_s;
  } else if (t_s < p.ramp_s + p.cruise_s) {
    done = 0.5 * p.peak_rad_s * p.ramp_s + p.peak_rad_s * (t_s - p.ramp_s);
  } else {
    const double left = total - t_s;
    done = distance - 0.5 * max_acceleration_rad_s2 * left * left;
  }
  return done / distance;
}

AxisLegs plan_legs(const AxisConfig& axis, double from_rad, double to_rad) {
  // Where the axis already stands at its target it came from below then; moving it would only cost time.
  const bool stands_there = std::abs(from_rad - to_rad) <= axis.tolerance_rad;
  if (axis.approach_rad == 0 || stands_there) return {false, 0, to_rad};
  const double detour = std::max(to_rad - axis.approach_rad, axis.min_rad);
  if (from_rad <= detour || detour >= to_rad) return {false, 0, to_rad};
  return {true, detour, to_rad};
}

double pose_change_time_s(const RigConfig& rig, const JointAngles& from, const JointAngles& to) {
  double first = 0;
  double second = 0;
  double settle = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisConfig& axis = rig.axes[i];
    const AxisLegs legs = plan_legs(axis, from[i], to[i]);
    const auto time = [&axis](double distance) {
      return travel_time_s(distance, axis.max_velocity_rad_s, axis.max_acceleration_rad_s2);
    };
    if (legs.has_detour) {
      first = std::max(first, time(legs.detour_rad - from[i]));
      second = std::max(second, time(to[i] - legs.detour_rad));
    } else {
      first = std::max(first, time(to[i] - from[i]));
    }
    settle = std::max(settle, axis.settle_s);
  }
  return first + second + settle;
}

}  // namespace rig::machine
