#include "drivers/common/camera_gain.h"

#include <cmath>
#include <limits>

namespace rig::drivers {

GainScale read_gain_scale(const base::ConfigTable& table) {
  GainScale scale;
  const std::string unit = table.choice_or("gain_unit", "dB", {"dB", "factor"});
  scale.unit = unit == "dB" ? GainUnit::decibel : GainUnit::factor;
  scale.counts = table.number_or("gain_counts", 1, {1e-6, 1e6});
  return scale;
}

double gain_value(const GainScale& scale, double factor) {
  if (!(factor > 0) || !std::isfinite(factor)) return std::numeric_limits<double>::quiet_NaN();
  const bool decibel = scale.unit == GainUnit::decibel;
  return scale.offset + scale.counts * (decibel ? 20 * std::log10(factor) : factor);
}

double gain_factor(const GainScale& scale, double value) {
  const double plain = (value - scale.offset) / scale.counts;
  return scale.unit == GainUnit::decibel ? std::pow(10.0, plain / 20) : plain;
}

}  // namespace rig::drivers
