// Small vectors, rotations and rigid transforms as plain values.
#pragma once

#include <array>
#include <cmath>

namespace rig::geometry {

struct Vec2 {
  double x = 0, y = 0;
};

struct Vec3 {
  double x = 0, y = 0, z = 0;
};

[[nodiscard]] constexpr Vec3 operator+(Vec3 a, Vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
[[nodiscard]] constexpr Vec3 operator-(Vec3 a, Vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
[[nodiscard]] constexpr Vec3 operator-(Vec3 a) {
  return {-a.x, -a.y, -a.z};
}
[[nodiscard]] constexpr Vec3 operator*(double s, Vec3 a) {
  return {s * a.x, s * a.y, s * a.z};
}
[[nodiscard]] constexpr double dot(Vec3 a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
[[nodiscard]] constexpr Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
[[nodiscard]] inline double length(Vec3 a) {
  return std::sqrt(dot(a, a));
}
[[nodiscard]] inline Vec3 normalized(Vec3 a) {
  return (1.0 / length(a)) * a;
}

/// Row-major 3 x 3 matrix.
struct Mat3 {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
  [[nodiscard]] constexpr double operator()(int r, int c) const {
    return m[static_cast<std::size_t>(3 * r + c)];
  }
  constexpr double& operator()(int r, int c) { return m[static_cast<std::size_t>(3 * r + c)]; }
};

[[nodiscard]] constexpr Vec3 operator*(const Mat3& a, Vec3 v) {
  return {a.m[0] * v.x + a.m[1] * v.y + a.m[2] * v.z, a.m[3] * v.x + a.m[4] * v.y + a.m[5] * v.z,
          a.m[6] * v.x + a.m[7] * v.y + a.m[8] * v.z};
}
[[nodiscard]] Mat3 operator*(const Mat3& a, const Mat3& b);
[[nodiscard]] Mat3 transposed(const Mat3& a);
[[nodiscard]] double determinant(const Mat3& a);

/// Right-handed rotation about a coordinate axis.
[[nodiscard]] Mat3 rotation_x(double angle_rad);
[[nodiscard]] Mat3 rotation_y(double angle_rad);
[[nodiscard]] Mat3 rotation_z(double angle_rad);

/// The rotation about `axis_angle`/|axis_angle| by |axis_angle| radians (Rodrigues), and its inverse with an
/// angle in [0, pi].
[[nodiscard]] Mat3 rotation_from_axis_angle(Vec3 axis_angle_rad);
[[nodiscard]] Vec3 axis_angle_from_rotation(const Mat3& rotation);

/// x_to = rotation * x_from + translation, named `to_from_...` by its users: camera_from_sample.
struct RigidTransform {
  Mat3 rotation;
  Vec3 translation;

  [[nodiscard]] constexpr Vec3 point(Vec3 p) const { return rotation * p + translation; }
  [[nodiscard]] constexpr Vec3 direction(Vec3 d) const { return rotation * d; }
};

/// a_from_c = a_from_b * b_from_c.
[[nodiscard]] RigidTransform operator*(const RigidTransform& a, const RigidTransform& b);
[[nodiscard]] RigidTransform inverse(const RigidTransform& a);

}  // namespace rig::geometry
