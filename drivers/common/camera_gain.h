// Between a gain, which is a factor, and the number that a camera has for it.
#pragma once

#include "core/base/config.h"

namespace rig::drivers {

enum class GainUnit { decibel, factor };

/// How a camera counts its gain.
struct GainScale {
  GainUnit unit = GainUnit::decibel;
  double counts = 1;  ///< for one dB, or for the factor 1
  double offset = 0;  ///< the camera's number at 0 dB, or (by extension) at the factor 0

  [[nodiscard]] bool operator==(const GainScale&) const = default;
};

/// The keys gain_unit and gain_counts; errors are noted in the table.
[[nodiscard]] GainScale read_gain_scale(const base::ConfigTable& table);

/// The camera's number for a factor, before it is rounded. A factor that is none (0, negative, no number)
/// gives no number.
[[nodiscard]] double gain_value(const GainScale& scale, double factor);

/// The inverse.
[[nodiscard]] double gain_factor(const GainScale& scale, double value);

}  // namespace rig::drivers
