// Between a device's counts and an axis' angle: the one conversion of every driver.
#pragma once

#include <cstdint>

#include "core/base/result.h"

namespace rig::drivers {

/// angle = zero_rad + counts / counts_per_rad, and with `reversed` zero_rad - counts / counts_per_rad.
struct CountScale {
  double counts_per_rad = 1;  ///< greater than 0
  double zero_rad = 0;        ///< the angle at count 0
  bool reversed = false;      ///< the motor turns the other way for a positive angle

  [[nodiscard]] double radians(double counts) const;

  /// The count nearest to an angle, halves away from zero: the error is at most half a count. An angle that
  /// is no number, or whose count does not fit a register of 32 bits with its sign, is bad_input.
  [[nodiscard]] base::Result<std::int32_t> counts(double angle_rad) const;

  /// The counts nearest to a distance, from wherever it is; bad_input as above.
  [[nodiscard]] base::Result<std::int32_t> distance(double by_rad) const;
  /// Where a distance from these counts ends, in counts; bad_input as above.
  [[nodiscard]] base::Result<std::int32_t> away_from(double counts, double by_rad) const;

  /// Of a speed or an acceleration, whose sign the device does not ask for: in counts per second (per
  /// second), rounded down, so that the device never exceeds what was allowed, but at least 1: zero would
  /// mean "for ever". Beyond 32 bits: bad_input.
  [[nodiscard]] base::Result<std::int32_t> rate(double rad_per_s) const;

  [[nodiscard]] double resolution_rad() const { return 1 / counts_per_rad; }
};

}  // namespace rig::drivers
