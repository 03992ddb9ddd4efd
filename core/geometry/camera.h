// The pinhole camera with radial and tangential distortion (Brown 1966, in the form and order of OpenCV).
#pragma once

#include <optional>

#include "core/geometry/vec.h"

namespace rig::geometry {

/// Pixel coordinates have the centre of the first pixel at (0, 0), as OpenCV has; the image spans -0.5 ..
/// width-0.5. The camera frame has x to the right of the image, y down and z forward.
struct CameraIntrinsics {
  int width = 0, height = 0;  ///< pixels
  double fx = 0, fy = 0;      ///< focal lengths, pixels
  double cx = 0, cy = 0;      ///< principal point, pixels
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};

/// Where a point in the camera frame (metres) is seen; nothing for a point that is not in front of the
/// camera.
[[nodiscard]] std::optional<Vec2> project(const CameraIntrinsics& camera, Vec3 point_m);

/// The direction (z = 1) in the camera frame of what a pixel sees; the inverse of `project` to 1e-9, nothing
/// where the iteration does not converge because the distortion folds there.
[[nodiscard]] std::optional<Vec3> unproject(const CameraIntrinsics& camera, Vec2 pixel);

/// The point of the plane z = 0 of the frame `camera_from_plane` starts in that a pixel sees; nothing where
/// the ray is parallel to it or meets it behind the camera.
[[nodiscard]] std::optional<Vec3> intersect_plane(const CameraIntrinsics& camera,
                                                  const RigidTransform& camera_from_plane, Vec2 pixel);

}  // namespace rig::geometry
