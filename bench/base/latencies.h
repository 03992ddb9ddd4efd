// Round trips that were measured, and what of them stands in the table.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

namespace rig::bench {

using Steady = std::chrono::steady_clock;

class Latencies {
 public:
  void add(Steady::duration took) { us_.push_back(std::chrono::duration<double, std::micro>(took).count()); }
  [[nodiscard]] std::size_t count() const { return us_.size(); }
  /// The smallest value that `share` of all do not exceed; at least one was added.
  [[nodiscard]] double quantile_us(double share) const {
    std::vector<double> sorted = us_;
    std::sort(sorted.begin(), sorted.end());
    const auto place = static_cast<std::size_t>(share * static_cast<double>(sorted.size()));
    return sorted[std::min(place, sorted.size() - 1)];
  }

 private:
  std::vector<double> us_;
};

/// Asks at a pace for a while: `ask()` waits for an answer, `pass_until(time)` takes what comes by itself
/// meanwhile. False where one of them failed.
template <typename Ask, typename PassUntil>
bool measure_block(Latencies& latencies, Steady::duration length, Steady::duration pace, Ask ask,
                   PassUntil pass_until) {
  const auto end = Steady::now() + length;
  for (auto next = Steady::now(); next < end; next += pace) {
    if (!pass_until(next)) return false;
    const auto begin = Steady::now();
    if (!ask()) return false;
    latencies.add(Steady::now() - begin);
  }
  return true;
}

}  // namespace rig::bench
