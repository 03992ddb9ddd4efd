#include "core/machine/exposure_bounds.h"

#include <cmath>
#include <numeric>
#include <vector>

#include "core/machine/exposure_prediction.h"

namespace rig::machine {

namespace {

double sum(const std::vector<double>& bracket) {
  return std::accumulate(bracket.begin(), bracket.end(), 0.0);
}

}  // namespace

int most_frames(const ExposureConfig& exposure) {
  switch (exposure.strategy) {
    case ExposureStrategy::fixed:
      return static_cast<int>(exposure.exposures_s.size());
    case ExposureStrategy::predicted:
      return static_cast<int>(exposure.lightest_s.size());
    case ExposureStrategy::halve:
    case ExposureStrategy::adaptive:
      return exposure.most_frames;
  }
  return 0;
}

double longest_bracket_s(const RigConfig& rig, const ExposureConfig& exposure, const JointAngles& pose) {
  switch (exposure.strategy) {
    case ExposureStrategy::fixed:
      return sum(exposure.exposures_s);
    case ExposureStrategy::predicted:
      return sum(predicted_bracket_s(exposure, mirror_angle_rad(rig, pose)));
    case ExposureStrategy::halve:
      return exposure.longest_s * (2 - std::ldexp(1.0, 1 - exposure.most_frames));
    case ExposureStrategy::adaptive:
      return exposure.first_s + exposure.longest_s * (exposure.most_frames - 1);
  }
  return 0;
}

}  // namespace rig::machine
