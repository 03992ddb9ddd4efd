// Direction pairs by place, so that only a few need comparing with a new one.
#pragma once

#include <vector>

#include "clients/plan/pair_distance.h"

namespace rig::plan {

/// A grid over the larger and the smaller polar angle and the angle between the two directions. None of the
/// three changes by more than the pair distance (the last by its square root of two), under any rotation,
/// mirror image or exchange: what is near is in a neighbouring cell, at the pole too.
class PairGrid {
 public:
  explicit PairGrid(double limit_rad);

  void add(const IsotropicPair& pair);
  /// Whether any pair added is within the limit of this one.
  [[nodiscard]] bool any_near(const IsotropicPair& pair) const;

 private:
  struct Cell {
    int larger, smaller, between;
  };
  [[nodiscard]] Cell cell_of(const IsotropicPair& pair) const;
  [[nodiscard]] std::size_t index(Cell cell) const;

  double limit_rad_;
  int polar_cells_, between_cells_;
  std::vector<std::vector<IsotropicPair>> cells_;
};

}  // namespace rig::plan
