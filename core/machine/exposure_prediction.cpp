#include "core/machine/exposure_prediction.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/directions.h"
#include "core/machine/kinematics.h"

namespace rig::machine {

double mirror_angle_rad(const RigConfig& rig, const JointAngles& angles) {
  const DirectionPair pair = directions_at_centre(rig, angles);
  return geometry::angle_between(pair.exitant, geometry::mirrored(pair.incident));
}

std::vector<double> predicted_bracket_s(const ExposureConfig& config, double mirror_rad) {
  const double share =
      std::clamp((mirror_rad - config.lightest_rad) / (config.darkest_rad - config.lightest_rad), 0.0, 1.0);
  if (share == 0) return config.lightest_s;
  if (share == 1) return config.darkest_s;
  std::vector<double> bracket;
  for (std::size_t i = 0; i < config.lightest_s.size(); ++i) {
    const double light = config.lightest_s[i];
    const double dark = config.darkest_s[i];
    bracket.push_back(std::clamp(light * std::pow(dark / light, share), light, dark));
  }
  return bracket;
}

}  // namespace rig::machine
