#include "calibration/projection.h"

namespace rig::calibration {

std::optional<Projection> project_with_derivatives(const geometry::CameraIntrinsics& camera,
                                                   geometry::Vec3 point_m) {
  const auto pixel = geometry::project(camera, point_m);
  if (!pixel) return std::nullopt;
  const double inverse_z = 1 / point_m.z;
  const double x = point_m.x * inverse_z, y = point_m.y * inverse_z;
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  const double radial_by_r2 = camera.k1 + r2 * (2 * camera.k2 + r2 * 3 * camera.k3);
  // Distorted by ideal image coordinates.
  const double xx = radial + 2 * x * x * radial_by_r2 + 2 * camera.p1 * y + 6 * camera.p2 * x;
  const double xy = 2 * x * y * radial_by_r2 + 2 * camera.p1 * x + 2 * camera.p2 * y;
  const double yy = radial + 2 * y * y * radial_by_r2 + 6 * camera.p1 * y + 2 * camera.p2 * x;
  const double fx = camera.fx * inverse_z, fy = camera.fy * inverse_z;
  return Projection{*pixel,
                    {fx * xx, fx * xy, -fx * (xx * x + xy * y), fy * xy, fy * yy, -fy * (xy * x + yy * y)}};
}

std::optional<PlaneProjection> project_from_plane(const geometry::CameraIntrinsics& camera,
                                                  const geometry::RigidTransform& camera_from_plane,
                                                  geometry::Vec3 point_m) {
  const auto p = project_with_derivatives(camera, camera_from_plane.point(point_m));
  if (!p) return std::nullopt;
  const geometry::Mat3& r = camera_from_plane.rotation;
  PlaneProjection out;
  out.pixel = p->pixel;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      const auto row = static_cast<std::size_t>(3 * i);
      out.by_plane[static_cast<std::size_t>(2 * i + j)] =
          p->by_point[row] * r(0, j) + p->by_point[row + 1] * r(1, j) + p->by_point[row + 2] * r(2, j);
    }
  }
  return out;
}

}  // namespace rig::calibration
