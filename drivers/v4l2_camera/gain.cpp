#include "drivers/v4l2_camera/gain.h"

#include <cmath>
#include <limits>

namespace rig::drivers::v4l2 {

double gain_value(const Settings& settings, double factor) {
  if (!(factor > 0) || !std::isfinite(factor)) return std::numeric_limits<double>::quiet_NaN();
  const bool decibel = settings.gain_unit == GainUnit::decibel;
  return settings.gain_offset + settings.gain_counts * (decibel ? 20 * std::log10(factor) : factor);
}

double gain_factor(const Settings& settings, double value) {
  const double plain = (value - settings.gain_offset) / settings.gain_counts;
  return settings.gain_unit == GainUnit::decibel ? std::pow(10.0, plain / 20) : plain;
}

}  // namespace rig::drivers::v4l2
