#include "core/machine/pose_order.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/machine/limits.h"
#include "core/machine/motion.h"

namespace rig::machine {

namespace {

constexpr std::size_t kMostImproved = 4000;  // poses; the passes below take the square of it
constexpr int kMostPasses = 8;
constexpr std::size_t kLongestRun = 3;
constexpr double kWorthwhile_s = 1e-6;

class Tour {
 public:
  Tour(const RigConfig& rig, const JointAngles& start, const std::vector<JointAngles>& poses)
      : rig_(rig), poses_(poses), start_(start) {}

  PoseTour build() {
    visit_nearest();
    if (tour_.order.size() <= kMostImproved) {
      for (int pass = 0; pass < kMostPasses && move_runs(); ++pass) {
      }
    }
    tour_.travel_s = 0;
    for (std::size_t i = 0; i < tour_.order.size(); ++i) tour_.travel_s += time(at(i), at(i + 1));
    return std::move(tour_);
  }

 private:
  // Station 0 is the start, station i the i-th pose of the tour.
  [[nodiscard]] const JointAngles& at(std::size_t station) const {
    return station == 0 ? start_ : poses_[tour_.order[station - 1]];
  }
  [[nodiscard]] double time(const JointAngles& from, const JointAngles& to) const {
    return pose_change_time_s(rig_, from, to);
  }
  [[nodiscard]] bool allowed(const JointAngles& from, const JointAngles& to) const {
    return check_move(rig_, from, to).has_value();
  }

  void visit_nearest() {
    std::vector<std::size_t> left(poses_.size());
    std::iota(left.begin(), left.end(), std::size_t{0});
    while (!left.empty()) {
      const JointAngles& here = at(tour_.order.size());
      std::vector<std::size_t> closed;  // from here
      bool moved = false;
      while (!moved && closed.size() < left.size()) {
        std::size_t nearest = 0;
        double nearest_s = std::numeric_limits<double>::infinity();
        for (const std::size_t i : left) {
          const double s = time(here, poses_[i]);
          if (s < nearest_s && std::find(closed.begin(), closed.end(), i) == closed.end()) {
            nearest = i;
            nearest_s = s;
          }
        }
        moved = allowed(here, poses_[nearest]);
        if (moved) {
          left.erase(std::find(left.begin(), left.end(), nearest));
          tour_.order.push_back(nearest);
        } else {
          closed.push_back(nearest);
        }
      }
      if (!moved) {
        tour_.unreachable = std::move(left);
        return;
      }
    }
  }

  // One pass over all runs of one to three poses; whether any was put elsewhere.
  bool move_runs() {
    bool any = false;
    for (std::size_t length = 1; length <= kLongestRun; ++length) {
      for (std::size_t first = 1; first + length <= tour_.order.size() + 1; ++first) {
        any = move_run(first, length) || any;
      }
    }
    return any;
  }

  // Takes the run of stations first .. last out and puts it where that saves most, in its own direction.
  bool move_run(std::size_t first, std::size_t length) {
    const std::size_t stations = tour_.order.size() + 1;
    const std::size_t last = first + length - 1;
    const bool at_end = last + 1 == stations;
    const double gap_s = at_end ? 0 : time(at(first - 1), at(last + 1));
    const double saved = time(at(first - 1), at(first)) + (at_end ? 0 : time(at(last), at(last + 1))) - gap_s;
    double best = kWorthwhile_s;
    std::size_t best_after = 0;
    bool found = false;
    for (std::size_t after = 0; after < stations; ++after) {
      if (after + 1 >= first && after <= last) continue;
      const bool to_end = after + 1 == stations;
      double cost = time(at(after), at(first));
      if (saved - cost < best) continue;
      if (!to_end) cost += time(at(last), at(after + 1)) - time(at(after), at(after + 1));
      if (saved - cost > best) {
        best = saved - cost;
        best_after = after;
        found = true;
      }
    }
    if (!found || !allowed(at(best_after), at(first))) return false;
    if (best_after + 1 != stations && !allowed(at(last), at(best_after + 1))) return false;
    if (!at_end && !allowed(at(first - 1), at(last + 1))) return false;
    // Station s is element s - 1 of the order.
    const auto begin = tour_.order.begin();
    const auto offset = [begin](std::size_t element) { return begin + static_cast<std::ptrdiff_t>(element); };
    if (best_after > last) {
      std::rotate(offset(first - 1), offset(last), offset(best_after));
    } else {
      std::rotate(offset(best_after), offset(first - 1), offset(last));
    }
    return true;
  }

  const RigConfig& rig_;
  const std::vector<JointAngles>& poses_;
  const JointAngles start_;
  PoseTour tour_;
};

}  // namespace

PoseTour order_poses(const RigConfig& rig, const JointAngles& start, const std::vector<JointAngles>& poses) {
  return Tour(rig, start, poses).build();
}

}  // namespace rig::machine
