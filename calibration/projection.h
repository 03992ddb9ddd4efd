// The camera's projection with its derivatives.
#pragma once

#include <array>
#include <optional>

#include "core/geometry/camera.h"
#include "core/geometry/vec.h"

namespace rig::calibration {

/// Where a point is seen and how that changes with the point.
struct Projection {
  geometry::Vec2 pixel;
  std::array<double, 6> by_point{};  ///< 2 x 3, row-major: d(pixel)/d(point), pixels per metre
};

/// geometry::project and its derivatives; nothing for a point that is not in front of the camera.
[[nodiscard]] std::optional<Projection> project_with_derivatives(const geometry::CameraIntrinsics& camera,
                                                                 geometry::Vec3 point_m);

/// Where a point of the sample plane is seen, and the 2 x 2 derivatives by its x and y, pixels per metre.
struct PlaneProjection {
  geometry::Vec2 pixel;
  std::array<double, 4> by_plane{};  ///< row-major: (du/dx, du/dy, dv/dx, dv/dy)
};
[[nodiscard]] std::optional<PlaneProjection> project_from_plane(
    const geometry::CameraIntrinsics& camera, const geometry::RigidTransform& camera_from_plane,
    geometry::Vec3 point_m);

}  // namespace rig::calibration
