#include "clients/plan/pair_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/units.h"

namespace rig::plan {

namespace {

int cells(double range_rad, double width_rad) {
  return static_cast<int>(std::floor(range_rad / width_rad)) + 1;
}

}  // namespace

PairGrid::PairGrid(double limit_rad)
    : limit_rad_(limit_rad),
      polar_cells_(cells(base::kPi, limit_rad)),
      between_cells_(cells(base::kPi, std::numbers::sqrt2 * limit_rad)),
      cells_(static_cast<std::size_t>(polar_cells_) * static_cast<std::size_t>(polar_cells_) *
             static_cast<std::size_t>(between_cells_)) {}

PairGrid::Cell PairGrid::cell_of(const IsotropicPair& pair) const {
  const auto polar = [this](double angle) {
    return std::min(static_cast<int>(angle / limit_rad_), polar_cells_ - 1);
  };
  return {polar(std::max(pair.incident_rad(), pair.exitant_rad())),
          polar(std::min(pair.incident_rad(), pair.exitant_rad())),
          std::min(static_cast<int>(pair.between_rad() / (std::numbers::sqrt2 * limit_rad_)),
                   between_cells_ - 1)};
}

std::size_t PairGrid::index(Cell cell) const {
  const auto row = static_cast<std::size_t>(cell.larger * polar_cells_ + cell.smaller);
  return row * static_cast<std::size_t>(between_cells_) + static_cast<std::size_t>(cell.between);
}

void PairGrid::add(const IsotropicPair& pair) {
  cells_[index(cell_of(pair))].push_back(pair);
}

bool PairGrid::any_near(const IsotropicPair& pair) const {
  const Cell centre = cell_of(pair);
  const auto near = [&](const IsotropicPair& other) { return nearer_than(pair, other, limit_rad_); };
  for (int a = std::max(0, centre.larger - 1); a <= std::min(polar_cells_ - 1, centre.larger + 1); ++a) {
    for (int b = std::max(0, centre.smaller - 1); b <= std::min(polar_cells_ - 1, centre.smaller + 1); ++b) {
      const int last = std::min(between_cells_ - 1, centre.between + 1);
      for (int c = std::max(0, centre.between - 1); c <= last; ++c) {
        const auto& cell = cells_[index({a, b, c})];
        if (std::any_of(cell.begin(), cell.end(), near)) return true;
      }
    }
  }
  return false;
}

}  // namespace rig::plan
