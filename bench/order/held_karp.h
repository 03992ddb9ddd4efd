// A lower bound for the time of every tour, to measure a found one against.
#pragma once

#include <cstddef>
#include <vector>

namespace rig::bench {

/// Symmetric travel times between `size` stations, row by row; the tour begins at station 0 and ends
/// anywhere.
struct SymmetricTimes {
  std::size_t size = 0;
  std::vector<float> seconds;  ///< size * size
  [[nodiscard]] float at(std::size_t a, std::size_t b) const { return seconds[a * size + b]; }
};

/// The bound of Held and Karp (1970, 1971) for open tours from station 0: the cheapest 1-tree, its special
/// node one more station to which the way from 0 and from every pose takes no time, under prices on the
/// stations that subgradient ascent makes as good as it can. No tour takes less, to the rounding of the
/// arithmetic. `good_s` is the time of any tour; it sets the length of the steps.
[[nodiscard]] double held_karp_bound_s(const SymmetricTimes& times, double good_s, int iterations);

}  // namespace rig::bench
