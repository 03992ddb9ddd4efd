// Which poses to take of an isotropic material: none nearer than a given angle to another (McAllister 2002,
// 3.3.2, with a distance that has no pole).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "clients/plan/pair_distance.h"
#include "core/base/result.h"
#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::plan {

struct ChoiceOptions {
  double apart_rad = 0;         ///< theta_d: least pair_distance between two poses, 2 to 90 degrees
  double step_rad = 0;          ///< of the walk through the angles of tilt, pan and arm
  double max_incident_rad = 0;  ///< steeper light is rejected
  double max_exitant_rad = 0;   ///< steeper view is rejected
};

struct Choice {
  std::vector<machine::JointAngles> poses;  ///< roll at home
  std::vector<IsotropicPair> pairs;         ///< of the poses
  std::size_t walked = 0;                   ///< stations of the walk
  std::size_t too_steep = 0;                ///< of them, beyond the largest polar angles
  std::size_t kept_out = 0;  ///< of those far enough from all poses, refused by the keep-out rules
};

/// Walks all multiples of the step within the limits of tilt, pan and arm and keeps a station whose
/// directions at the sample's centre are farther than apart_rad from those of every station kept before. The
/// same input gives the same choice on any number of cores. Refuses options that leave nothing to choose;
/// interrupted between stretches of the walk.
[[nodiscard]] base::Result<Choice> choose_poses(const machine::RigConfig& rig, const ChoiceOptions& options);

/// A roll for each of `count` poses: one in each of `count` equal parts of the axis' range (of one full turn
/// at most), at random within it and in random order, so that every other angle meets rolls all around.
/// Determined by `seed`.
[[nodiscard]] std::vector<double> stratified_rolls(const machine::AxisConfig& roll, std::size_t count,
                                                   std::uint64_t seed);

}  // namespace rig::plan
