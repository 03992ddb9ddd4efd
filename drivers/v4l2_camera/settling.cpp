#include "drivers/v4l2_camera/settling.h"

#include <algorithm>
#include <cmath>

namespace rig::drivers::v4l2 {

namespace {

constexpr std::size_t kAtEnd = 3;  // so many levels are the end
constexpr double kShare = 0.1;     // of the change: closer is arrived
constexpr double kAboveNoise = 5;  // a change is so many times larger than what the end varies by

}  // namespace

std::optional<int> settled_at(double before, std::span<const double> levels, double least) {
  if (levels.size() < 2 * kAtEnd) return std::nullopt;
  const auto end = levels.last(kAtEnd);
  const auto [low, high] = std::minmax_element(end.begin(), end.end());
  const double noise = *high - *low;
  const double reached = (*low + *high) / 2;
  const double change = std::abs(reached - before);
  if (!(change >= least) || change < kAboveNoise * noise) return std::nullopt;
  const double near = std::max(kShare * change, noise);
  std::size_t first = levels.size();
  while (first > 0 && std::abs(levels[first - 1] - reached) <= near) --first;
  if (first + kAtEnd > levels.size()) return std::nullopt;
  return static_cast<int>(first);
}

}  // namespace rig::drivers::v4l2
