#include "bench/order/held_karp.h"

#include <algorithm>
#include <limits>

namespace rig::bench {

namespace {

struct OneTree {
  double priced_s = 0;      // with the prices of its edges' ends
  std::vector<int> degree;  // of each station
};

// Prim's algorithm on the dense matrix, and the two edges of the special node.
OneTree cheapest_one_tree(const SymmetricTimes& times, const std::vector<double>& price) {
  const std::size_t n = times.size;
  OneTree tree;
  tree.degree.assign(n, 0);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<double> reach(n, kFar);
  std::vector<std::size_t> from(n, 0);
  std::vector<bool> inside(n, false);
  std::size_t added = 0;
  for (std::size_t count = 1; count < n; ++count) {
    inside[added] = true;
    std::size_t next = 0;
    double next_s = kFar;
    for (std::size_t i = 0; i < n; ++i) {
      if (inside[i]) continue;
      const double s = static_cast<double>(times.at(added, i)) + price[added] + price[i];
      if (s < reach[i]) {
        reach[i] = s;
        from[i] = added;
      }
      if (reach[i] < next_s) {
        next_s = reach[i];
        next = i;
      }
    }
    tree.priced_s += next_s;
    ++tree.degree[next];
    ++tree.degree[from[next]];
    added = next;
  }
  // The tour closes through the special node: from its last pose, whichever that is, back to the start.
  const auto last = std::min_element(price.begin() + 1, price.end());
  tree.priced_s += price[0] + *last;
  ++tree.degree[0];
  ++tree.degree[static_cast<std::size_t>(last - price.begin())];
  return tree;
}

}  // namespace

double held_karp_bound_s(const SymmetricTimes& times, double good_s, int iterations) {
  std::vector<double> price(times.size, 0);
  std::vector<int> before(times.size, 2);
  double best_s = -std::numeric_limits<double>::infinity();
  double boldness = 1;
  int since_better = 0;
  constexpr int kPatience = 20;
  constexpr double kCaution = 0.8;
  for (int k = 0; k < iterations; ++k) {
    const OneTree tree = cheapest_one_tree(times, price);
    double bound_s = tree.priced_s;
    for (const double p : price) bound_s -= 2 * p;
    ++since_better;
    if (bound_s > best_s) {
      best_s = bound_s;
      since_better = 0;
    } else if (since_better >= kPatience) {
      boldness *= kCaution;
      since_better = 0;
    }
    double square = 0;
    for (const int d : tree.degree) square += (d - 2) * (d - 2);
    if (square == 0) return best_s;  // the 1-tree is a tour
    const double step = boldness * (good_s - bound_s) / square;
    for (std::size_t i = 0; i < price.size(); ++i) {
      // A part of the step before damps the swinging (Volgenant and Jonker 1982).
      price[i] += step * (0.7 * (tree.degree[i] - 2) + 0.3 * (before[i] - 2));
    }
    before = tree.degree;
  }
  return best_s;
}

}  // namespace rig::bench
