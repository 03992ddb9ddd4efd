#include "drivers/common/counts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "drivers/common/rounding.h"

namespace rig::drivers {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr double kMost = std::numeric_limits<std::int32_t>::max();

}  // namespace

double CountScale::radians(double counts) const {
  return zero_rad + (reversed ? -counts : counts) / counts_per_rad;
}

Result<std::int32_t> CountScale::counts(double angle_rad) const {
  const double exact = (angle_rad - zero_rad) * (reversed ? -counts_per_rad : counts_per_rad);
  const double rounded = std::round(exact);
  if (!(std::abs(rounded) <= kMost)) {
    return fail(ErrorCode::bad_input,
                fmt::format("{} rad is {} counts, beyond what the device can count to", angle_rad, exact));
  }
  return static_cast<std::int32_t>(rounded);
}

Result<std::int32_t> CountScale::distance(double by_rad) const {
  return CountScale{counts_per_rad, 0, reversed}.counts(by_rad);
}

Result<std::int32_t> CountScale::away_from(double counts, double by_rad) const {
  const auto by = distance(by_rad);
  if (!by) return by;
  const double there = std::round(counts) + *by;
  if (std::abs(there) <= kMost) return static_cast<std::int32_t>(there);
  return fail(ErrorCode::bad_input,
              fmt::format("{} rad from {} counts is beyond what the device can count to", by_rad, counts));
}

Result<std::int32_t> CountScale::rate(double rad_per_s) const {
  const double exact = std::abs(rad_per_s) * counts_per_rad;
  const double floored = rounded(exact, Rounding::down);
  if (!(floored <= kMost)) {
    return fail(ErrorCode::bad_input,
                fmt::format("{} rad/s is {} counts/s, beyond what the device can take", rad_per_s, exact));
  }
  return static_cast<std::int32_t>(std::max(floored, 1.0));
}

}  // namespace rig::drivers
