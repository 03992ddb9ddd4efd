// Radians, metres and seconds inside; degrees, millimetres and microseconds at the edges, through these.
#pragma once

#include <numbers>

namespace rig::base {

inline constexpr double kPi = std::numbers::pi;

[[nodiscard]] constexpr double radians(double degrees) {
  return degrees * (kPi / 180.0);
}
[[nodiscard]] constexpr double degrees(double radians) {
  return radians * (180.0 / kPi);
}
[[nodiscard]] constexpr double metres_from_mm(double mm) {
  return mm * 1e-3;
}
[[nodiscard]] constexpr double mm_from_metres(double m) {
  return m * 1e3;
}

}  // namespace rig::base
