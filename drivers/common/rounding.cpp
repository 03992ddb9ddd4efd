#include "drivers/common/rounding.h"

#include <cmath>

namespace rig::drivers {

double rounded(double exact, Rounding how) {
  constexpr double kLastBits = 1e-9;
  const double nearest = std::round(exact);
  if (std::abs(exact - nearest) <= kLastBits * std::abs(exact)) return nearest;
  if (how == Rounding::down) return std::floor(exact);
  if (how == Rounding::up) return std::ceil(exact);
  return nearest;
}

}  // namespace rig::drivers
