#include "core/geometry/camera.h"

#include <cmath>

namespace rig::geometry {

namespace {

struct Distorted {
  double x, y;        // distorted normalised coordinates
  double xx, xy, yy;  // their derivatives: dx/dx, dx/dy (= dy/dx), dy/dy
};

Distorted distort(const CameraIntrinsics& c, double x, double y) {
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  const double slope = c.k1 + r2 * (2 * c.k2 + r2 * 3 * c.k3);  // d radial / d r2
  Distorted d{};
  d.x = x * radial + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x);
  d.y = y * radial + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y;
  d.xx = radial + 2 * x * x * slope + 2 * c.p1 * y + 6 * c.p2 * x;
  d.xy = 2 * x * y * slope + 2 * c.p1 * x + 2 * c.p2 * y;
  d.yy = radial + 2 * y * y * slope + 6 * c.p1 * y + 2 * c.p2 * x;
  return d;
}

}  // namespace

std::optional<Vec2> project(const CameraIntrinsics& camera, Vec3 p) {
  if (!(p.z > 0)) return std::nullopt;
  const Distorted d = distort(camera, p.x / p.z, p.y / p.z);
  return Vec2{camera.fx * d.x + camera.cx, camera.fy * d.y + camera.cy};
}

std::optional<Vec3> unproject(const CameraIntrinsics& camera, Vec2 pixel) {
  const double u = (pixel.x - camera.cx) / camera.fx;
  const double v = (pixel.y - camera.cy) / camera.fy;
  double x = u;
  double y = v;
  constexpr int kMostSteps = 30;
  for (int i = 0; i < kMostSteps; ++i) {
    const Distorted d = distort(camera, x, y);
    const double ex = d.x - u;
    const double ey = d.y - v;
    if (std::hypot(ex, ey) < 1e-12) return Vec3{x, y, 1};
    const double determinant = d.xx * d.yy - d.xy * d.xy;
    if (!(std::abs(determinant) > 1e-6)) return std::nullopt;
    x -= (d.yy * ex - d.xy * ey) / determinant;
    y -= (d.xx * ey - d.xy * ex) / determinant;
  }
  return std::nullopt;
}

std::optional<Vec3> intersect_plane(const CameraIntrinsics& camera, const RigidTransform& camera_from_plane,
                                    Vec2 pixel) {
  const auto ray = unproject(camera, pixel);
  if (!ray) return std::nullopt;
  const RigidTransform plane_from_camera = inverse(camera_from_plane);
  const Vec3 origin = plane_from_camera.translation;
  const Vec3 direction = plane_from_camera.direction(*ray);
  if (direction.z == 0) return std::nullopt;
  const double t = -origin.z / direction.z;
  if (!(t > 0)) return std::nullopt;
  Vec3 hit = origin + t * direction;
  hit.z = 0;
  return hit;
}

}  // namespace rig::geometry
