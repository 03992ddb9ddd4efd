// Directions on the hemisphere of the sample: unit vectors in the sample frame, z along the outward normal;
// polar angle from z, azimuth from x towards y.
#pragma once

#include "core/geometry/vec.h"

namespace rig::geometry {

struct Polar {
  double theta_rad = 0;  ///< polar angle from the normal, 0 .. pi
  double phi_rad = 0;    ///< azimuth, -pi .. pi
};

[[nodiscard]] Vec3 direction_from_polar(Polar angles);
[[nodiscard]] Polar polar_from_direction(Vec3 direction);

/// Angle between two unit vectors, accurate also where it is small or near pi.
[[nodiscard]] double angle_between(Vec3 a, Vec3 b);

/// The mirror direction of `d` about the normal z.
[[nodiscard]] constexpr Vec3 mirrored(Vec3 d) {
  return {-d.x, -d.y, d.z};
}

/// The unit vector halfway between two unit vectors that are not opposite.
[[nodiscard]] inline Vec3 half_vector(Vec3 a, Vec3 b) {
  return normalized(a + b);
}

}  // namespace rig::geometry
