// In which order to take poses: the one place that decides it, for a plan and for poses added to a running
// job.
#pragma once

#include <cstddef>
#include <vector>

#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

struct PoseTour {
  std::vector<std::size_t> order;        ///< indices into the poses given
  std::vector<std::size_t> unreachable;  ///< poses to which no allowed move led when their turn came
  double travel_s = 0;                   ///< from the start through all of `order`, with settling
};

/// A short tour from `start` through all poses: to the nearest by pose_change_time_s each time (the lower
/// index where two are equally near), over moves that check_move allows, then bettered by putting runs of up
/// to three poses elsewhere while that saves time (Or 1976). The same input gives the same tour.
[[nodiscard]] PoseTour order_poses(const RigConfig& rig, const JointAngles& start,
                                   const std::vector<JointAngles>& poses);

}  // namespace rig::machine
