// From radiance to reflectance, texel by texel (McAllister 2002, 3.6.1).
#pragma once

#include <cmath>

#include "core/geometry/vec.h"
#include "core/machine/kinematics.h"
#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::calibration {

/// Where the light is in the sample frame of a registered pose: the arm's angle and the camera's place on the
/// bench are taken from the rig's description, the carrier from its fiducials.
[[nodiscard]] inline geometry::Vec3 light_in_sample(const machine::RigConfig& rig,
                                                    const geometry::RigidTransform& camera_from_sample,
                                                    const machine::JointAngles& angles) {
  const geometry::Vec3 light = machine::light_in_bench(rig.light, angles);
  return geometry::inverse(camera_from_sample).point(rig.camera.camera_from_bench.point(light));
}

/// Irradiance at a point of the sample plane for a light of unit intensity, 1/m^2: cos(theta_i) / r^2, with
/// the point's own direction and distance. Zero where the light is below the horizon.
[[nodiscard]] inline double irradiance_per_intensity(geometry::Vec3 light_m, geometry::Vec3 point_m) {
  const geometry::Vec3 to_light = light_m - point_m;
  const double r2 = dot(to_light, to_light);
  return to_light.z <= 0 ? 0 : to_light.z / (r2 * std::sqrt(r2));
}

}  // namespace rig::calibration
