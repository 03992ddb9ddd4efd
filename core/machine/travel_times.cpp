#include "core/machine/travel_times.h"

#include <algorithm>

#include "core/base/parallel.h"
#include "core/machine/limits.h"
#include "core/machine/motion.h"

namespace rig::machine {

namespace {

constexpr std::size_t kMostInTable = 4000;  // stations; 64 MB of times and 16 MB of verdicts
constexpr std::size_t kChunk = 16;          // rows a core takes at a time

}  // namespace

TravelTimes::TravelTimes(const RigConfig& rig, const JointAngles& start,
                         const std::vector<JointAngles>& poses)
    : rig_(rig), poses_(poses), start_(start) {
  const std::size_t n = size();
  if (n > kMostInTable) return;
  std::vector<float> table(n * n);
  base::parallel_for(n, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t from = begin; from < end; ++from) {
      for (std::size_t to = 0; to < n; ++to) {
        table[from * n + to] = compute(static_cast<Station>(from), static_cast<Station>(to));
      }
    }
  });
  table_ = std::move(table);
  verdicts_.assign(n * n, Verdict::unknown);
}

float TravelTimes::compute(Station from, Station to) const {
  return static_cast<float>(pose_change_time_s(rig_, at(from), at(to)));
}

bool TravelTimes::allowed(Station from, Station to) {
  const std::size_t key = from * size() + to;
  if (verdicts_.empty()) {
    const auto [found, fresh] = known_.try_emplace(key, false);
    if (fresh) found->second = check_move(rig_, at(from), at(to)).has_value();
    return found->second;
  }
  if (verdicts_[key] == Verdict::unknown) {
    verdicts_[key] = check_move(rig_, at(from), at(to)) ? Verdict::yes : Verdict::no;
  }
  return verdicts_[key] == Verdict::yes;
}

std::vector<std::vector<Station>> TravelTimes::nearest(std::size_t count) const {
  struct Near {
    float seconds;
    Station station;
    bool operator<(const Near& other) const {
      return seconds != other.seconds ? seconds < other.seconds : station < other.station;
    }
  };
  std::vector<std::vector<Station>> lists(size());
  base::parallel_for(size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<Near> all;
    for (std::size_t i = begin; i < end; ++i) {
      const auto here = static_cast<Station>(i);
      all.clear();
      for (Station other = 1; other < size(); ++other) {
        if (other != here) all.push_back({std::min(seconds(here, other), seconds(other, here)), other});
      }
      const std::size_t kept = std::min(count, all.size());
      std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(kept), all.end());
      for (std::size_t k = 0; k < kept; ++k) lists[i].push_back(all[k].station);
    }
  });
  return lists;
}

}  // namespace rig::machine
