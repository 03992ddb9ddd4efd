// How long it takes to get from any pose to any other, and whether one may: what a search for a short tour
// asks millions of times.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

/// A place of the tour: 0 is where it starts, i + 1 the pose of index i.
using Station = std::uint32_t;

class TravelTimes {
 public:
  /// Up to a few thousand poses all times are computed at once, on all cores; beyond that when asked for.
  /// `rig` and `poses` must outlive this.
  TravelTimes(const RigConfig& rig, const JointAngles& start, const std::vector<JointAngles>& poses);

  [[nodiscard]] std::size_t size() const { return poses_.size() + 1; }
  [[nodiscard]] const JointAngles& at(Station station) const {
    return station == 0 ? start_ : poses_[station - 1];
  }
  /// pose_change_time_s, to single precision.
  [[nodiscard]] float seconds(Station from, Station to) const {
    return table_.empty() ? compute(from, to) : table_[from * size() + to];
  }
  /// check_move, remembered.
  [[nodiscard]] bool allowed(Station from, Station to);

  /// For each station the `count` poses that are nearest in the quicker of both directions, the nearest first
  /// and the lower index where two are equally near.
  [[nodiscard]] std::vector<std::vector<Station>> nearest(std::size_t count) const;

 private:
  [[nodiscard]] float compute(Station from, Station to) const;

  const RigConfig& rig_;
  const std::vector<JointAngles>& poses_;
  JointAngles start_;
  std::vector<float> table_;
  enum class Verdict : std::uint8_t { unknown, yes, no };
  std::vector<Verdict> verdicts_;                  // beside table_
  std::unordered_map<std::uint64_t, bool> known_;  // where there is no table
};

}  // namespace rig::machine
