#include "core/geometry/directions.h"

#include <cmath>

namespace rig::geometry {

Vec3 direction_from_polar(Polar angles) {
  const double s = std::sin(angles.theta_rad);
  return {s * std::cos(angles.phi_rad), s * std::sin(angles.phi_rad), std::cos(angles.theta_rad)};
}

Polar polar_from_direction(Vec3 d) {
  return {std::atan2(std::hypot(d.x, d.y), d.z), std::atan2(d.y, d.x)};
}

double angle_between(Vec3 a, Vec3 b) {
  return 2.0 * std::atan2(length(a - b), length(a + b));
}

}  // namespace rig::geometry
