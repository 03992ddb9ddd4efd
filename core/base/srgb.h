// The transfer function of sRGB (IEC 61966-2-1), between light and code, both 0 to 1.
#pragma once

#include <cmath>

namespace rig::base {

[[nodiscard]] inline double srgb_from_linear(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}
/// The inverse of srgb_from_linear.
[[nodiscard]] inline double linear_from_srgb(double code) {
  return code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4);
}

}  // namespace rig::base
