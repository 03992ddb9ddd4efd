// The order of poses: its travel time beside the bound of Held and Karp, which no order can beat, for the
// isotropic plans of 10 and 5 degrees on the virtual rig.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fmt/format.h>

#include "bench/order/held_karp.h"
#include "clients/plan/pose_choice.h"
#include "core/base/parallel.h"
#include "core/base/units.h"
#include "core/machine/motion.h"
#include "core/machine/pose_order.h"

namespace {

using namespace rig;
using base::radians;
using Steady = std::chrono::steady_clock;

constexpr int kIterations = 1500;
// The tour's travel time over the bound, both of the symmetrised times, without settling.
constexpr double kMostOverBound = 1.10;

// How the two directions between two stations become one time.
enum class Symmetry {
  quicker,  // no tour takes less than one in these times
  mean,     // a tour in these times is the mean of itself and its reverse
};

// Without `settle_s`, which each move has after it whatever the order.
bench::SymmetricTimes symmetrised(const machine::RigConfig& rig,
                                  const std::vector<machine::JointAngles>& stations, Symmetry symmetry,
                                  double settle_s) {
  bench::SymmetricTimes times{stations.size(), std::vector<float>(stations.size() * stations.size())};
  base::parallel_for(times.size, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t a = begin; a < end; ++a) {
      for (std::size_t b = 0; b < times.size; ++b) {
        const double there = machine::pose_change_time_s(rig, stations[a], stations[b]);
        const double back = machine::pose_change_time_s(rig, stations[b], stations[a]);
        const double one = symmetry == Symmetry::quicker ? std::min(there, back) : (there + back) / 2;
        times.seconds[a * times.size + b] = static_cast<float>(one - settle_s);
      }
    }
  });
  return times;
}

base::Result<void> run(const machine::RigConfig& rig, double apart_deg) {
  auto choice = plan::choose_poses(rig, {radians(apart_deg), radians(1), radians(75), radians(65)});
  if (!choice) return base::pass(choice);
  const auto rolls = plan::stratified_rolls(rig.axes[0], choice->poses.size(), 1);
  for (std::size_t i = 0; i < rolls.size(); ++i) choice->poses[i][0] = rolls[i];
  machine::JointAngles home{};
  for (std::size_t i = 0; i < machine::kAxisCount; ++i) home[i] = rig.axes[i].home_rad;

  const auto begin = Steady::now();
  const auto tour = machine::order_poses(rig, home, choice->poses);
  const double took_s = std::chrono::duration<double>(Steady::now() - begin).count();
  if (!tour.unreachable.empty()) {
    return base::fail(base::ErrorCode::refused, "no allowed move leads to some of the poses");
  }
  std::vector<machine::JointAngles> stations{home};
  stations.insert(stations.end(), choice->poses.begin(), choice->poses.end());
  double settle_s = 0;
  for (const auto& axis : rig.axes) settle_s = std::max(settle_s, axis.settle_s);
  const double all_settle_s = settle_s * static_cast<double>(choice->poses.size());
  const double travel_s = tour.travel_s - all_settle_s;
  const double bound_s = bench::held_karp_bound_s(symmetrised(rig, stations, Symmetry::quicker, settle_s),
                                                  travel_s, kIterations);
  const auto mean = symmetrised(rig, stations, Symmetry::mean, settle_s);
  double mean_s = 0;
  std::size_t here = 0;
  for (const std::size_t pose : tour.order) {
    mean_s += static_cast<double>(mean.at(here, pose + 1));
    here = pose + 1;
  }
  const double mean_bound_s = bench::held_karp_bound_s(mean, mean_s, kIterations);
  std::printf(
      "%g deg: %zu poses, tour %.1f s with settling, found in %.1f s; over the bound on\n"
      "  the quicker direction's times %.4f with settling, %.4f without\n"
      "  both directions' mean times   %.4f with settling, %.4f without\n",
      apart_deg, choice->poses.size(), tour.travel_s, took_s, tour.travel_s / (bound_s + all_settle_s),
      travel_s / bound_s, (mean_s + all_settle_s) / (mean_bound_s + all_settle_s), mean_s / mean_bound_s);
  if (mean_s > kMostOverBound * mean_bound_s) {
    return base::fail(
        base::ErrorCode::bad_input,
        fmt::format("the tour at {} deg is more than {} times the bound", apart_deg, kMostOverBound));
  }
  return {};
}

}  // namespace

int main() {
  const auto rig = machine::load_rig_config(RIG_SOURCE_DIR "/share/virtual/rig.toml");
  if (!rig) {
    std::fprintf(stderr, "bench_order: %s\n", rig.error().text().c_str());
    return 1;
  }
  for (const double apart_deg : {10.0, 5.0}) {
    if (auto ok = run(*rig, apart_deg); !ok) {
      std::fprintf(stderr, "bench_order: %s\n", ok.error().text().c_str());
      return 1;
    }
  }
  return 0;
}
