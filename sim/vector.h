// The virtual rig's own vectors: it shares no geometry with the code that it is to test.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

namespace rig::sim {

inline constexpr double kPi = std::numbers::pi;

struct V3 {
  double x = 0, y = 0, z = 0;
};
constexpr V3 operator+(V3 a, V3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
constexpr V3 operator-(V3 a, V3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
constexpr V3 operator*(double s, V3 a) {
  return {s * a.x, s * a.y, s * a.z};
}
constexpr double dot(V3 a, V3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
constexpr V3 cross(V3 a, V3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(V3 a) {
  return std::sqrt(dot(a, a));
}
inline V3 unit(V3 a) {
  return (1 / norm(a)) * a;
}

/// A frame in the bench: where its origin is and where its axes point.
struct Frame {
  V3 origin;
  V3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

  [[nodiscard]] constexpr V3 out(V3 local) const { return origin + local.x * x + local.y * y + local.z * z; }
  [[nodiscard]] constexpr V3 in(V3 bench) const {
    const V3 d = bench - origin;
    return {dot(d, x), dot(d, y), dot(d, z)};
  }
};

/// `v` turned about the unit vector `axis`, right-handed.
inline V3 turned(V3 v, V3 axis, double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return c * v + s * cross(axis, v) + (1 - c) * dot(axis, v) * axis;
}

}  // namespace rig::sim
