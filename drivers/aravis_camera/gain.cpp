#include "drivers/aravis_camera/gain.h"

#include <cmath>
#include <limits>

namespace rig::drivers::aravis {

double gain_value(const Settings& settings, bool whole, double factor) {
  if (!(factor > 0) || !std::isfinite(factor)) return std::numeric_limits<double>::quiet_NaN();
  const bool decibel = settings.gain_unit == GainUnit::decibel;
  const double value = settings.gain_counts * (decibel ? 20 * std::log10(factor) : factor);
  return whole ? std::round(value) : value;
}

double gain_factor(const Settings& settings, double value) {
  const double plain = value / settings.gain_counts;
  return settings.gain_unit == GainUnit::decibel ? std::pow(10.0, plain / 20) : plain;
}

}  // namespace rig::drivers::aravis
