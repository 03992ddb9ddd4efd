#include "core/machine/pose_order.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/machine/motion.h"
#include "core/machine/tour_search.h"
#include "core/machine/travel_times.h"

namespace rig::machine {

namespace {

// Random exchanges: what more of them gain is below a tenth of a per cent; the bound is for time's sake.
constexpr std::size_t kExchangesPerPose = 60;
constexpr std::size_t kMostExchanges = 150'000;

// The first tour: greedy.
class GreedyTour {
 public:
  explicit GreedyTour(TravelTimes& times) : times_(times), left_(times.size(), true) { left_[0] = false; }

  std::vector<Station> build() {
    std::vector<Station> tour{0};
    while (auto next = nearest_to(tour.back())) {
      left_[*next] = false;
      tour.push_back(*next);
    }
    return tour;
  }

 private:
  // Of those left, the nearest that may be gone to.
  std::optional<Station> nearest_to(Station here) {
    closed_.assign(left_.size(), false);
    while (true) {
      Station nearest = 0;
      float nearest_s = std::numeric_limits<float>::infinity();
      for (Station s = 1; s < left_.size(); ++s) {
        if (!left_[s] || closed_[s]) continue;
        const float seconds = times_.seconds(here, s);
        if (seconds < nearest_s) {
          nearest = s;
          nearest_s = seconds;
        }
      }
      if (nearest == 0) return std::nullopt;
      if (times_.allowed(here, nearest)) return nearest;
      closed_[nearest] = true;
    }
  }

  TravelTimes& times_;
  std::vector<bool> left_;
  std::vector<bool> closed_;  // from where it stands
};

}  // namespace

PoseTour order_poses(const RigConfig& rig, const JointAngles& start, const std::vector<JointAngles>& poses,
                     const std::function<void(std::size_t, std::size_t)>& on_progress) {
  TravelTimes times(rig, start, poses);
  TourSearch search(times, GreedyTour(times).build());
  search.descend();
  const std::size_t exchanges = std::min(kExchangesPerPose * poses.size(), kMostExchanges);
  search.shake(exchanges, [&](std::size_t done) {
    if (on_progress) on_progress(done, exchanges);
  });
  if (on_progress) on_progress(exchanges, exchanges);

  PoseTour tour;
  std::vector<bool> visited(poses.size(), false);
  JointAngles here = start;
  for (const Station station : search.tour()) {
    if (station == 0) continue;
    const std::size_t pose = station - 1;
    tour.order.push_back(pose);
    visited[pose] = true;
    tour.travel_s += pose_change_time_s(rig, here, poses[pose]);
    here = poses[pose];
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!visited[i]) tour.unreachable.push_back(i);
  }
  return tour;
}

}  // namespace rig::machine
