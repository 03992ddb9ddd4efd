// In which order to take poses: the one place that decides it, for a plan and for poses added to a running
// job.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

struct PoseTour {
  std::vector<std::size_t> order;        ///< indices into the poses given
  std::vector<std::size_t> unreachable;  ///< poses to which no allowed move led when their turn came
  double travel_s = 0;                   ///< from the start through all of `order`, with settling
};

/// A short tour from `start` through all poses, in pose_change_time_s, over moves that check_move allows:
/// always to a pose nearby that is left, then bettered by a local search (tour_search.h) of bounded length.
/// The same input gives the same tour. `on_progress` may be empty; it is called with how much of how much is
/// done.
[[nodiscard]] PoseTour order_poses(const RigConfig& rig, const JointAngles& start,
                                   const std::vector<JointAngles>& poses,
                                   const std::function<void(std::size_t, std::size_t)>& on_progress = {});

}  // namespace rig::machine
