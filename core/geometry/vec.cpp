#include "core/geometry/vec.h"

#include <algorithm>
#include <numbers>

namespace rig::geometry {

Mat3 operator*(const Mat3& a, const Mat3& b) {
  Mat3 out;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) out(r, c) = a(r, 0) * b(0, c) + a(r, 1) * b(1, c) + a(r, 2) * b(2, c);
  }
  return out;
}

Mat3 transposed(const Mat3& a) {
  return {{a(0, 0), a(1, 0), a(2, 0), a(0, 1), a(1, 1), a(2, 1), a(0, 2), a(1, 2), a(2, 2)}};
}

double determinant(const Mat3& a) {
  return dot({a(0, 0), a(0, 1), a(0, 2)}, cross({a(1, 0), a(1, 1), a(1, 2)}, {a(2, 0), a(2, 1), a(2, 2)}));
}

Mat3 rotation_x(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{1, 0, 0, 0, c, -s, 0, s, c}};
}

Mat3 rotation_y(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{c, 0, s, 0, 1, 0, -s, 0, c}};
}

Mat3 rotation_z(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {{c, -s, 0, s, c, 0, 0, 0, 1}};
}

Mat3 rotation_from_axis_angle(Vec3 axis_angle_rad) {
  const double angle = length(axis_angle_rad);
  if (angle < 1e-12) {
    const Vec3 w = axis_angle_rad;
    return {{1, -w.z, w.y, w.z, 1, -w.x, -w.y, w.x, 1}};
  }
  const Vec3 u = (1.0 / angle) * axis_angle_rad;
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  const double k = 1 - c;
  return {{c + k * u.x * u.x, k * u.x * u.y - s * u.z, k * u.x * u.z + s * u.y, k * u.x * u.y + s * u.z,
           c + k * u.y * u.y, k * u.y * u.z - s * u.x, k * u.x * u.z - s * u.y, k * u.y * u.z + s * u.x,
           c + k * u.z * u.z}};
}

Vec3 axis_angle_from_rotation(const Mat3& r) {
  const Vec3 skew{r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
  const double sine = 0.5 * length(skew);
  const double cosine = 0.5 * (r(0, 0) + r(1, 1) + r(2, 2) - 1);
  const double angle = std::atan2(sine, cosine);
  if (sine > 1e-7) return (0.5 * angle / sine) * skew;
  if (cosine > 0) return 0.5 * skew;
  // Half a turn: the axis is the column of (R + I) / 2 with the largest diagonal.
  const std::array<double, 3> diagonal{r(0, 0), r(1, 1), r(2, 2)};
  const int i = static_cast<int>(std::max_element(diagonal.begin(), diagonal.end()) - diagonal.begin());
  Vec3 axis{r(0, i), r(1, i), r(2, i)};
  (i == 0 ? axis.x : i == 1 ? axis.y : axis.z) += 1;
  axis = normalized(axis);
  return (dot(axis, skew) < 0 ? -angle : angle) * axis;
}

RigidTransform operator*(const RigidTransform& a, const RigidTransform& b) {
  return {a.rotation * b.rotation, a.point(b.translation)};
}

RigidTransform inverse(const RigidTransform& a) {
  const Mat3 r = transposed(a.rotation);
  return {r, -(r * a.translation)};
}

}  // namespace rig::geometry
