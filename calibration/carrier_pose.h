// The pose of a plane of known points before a camera of known intrinsics, and how sure it is.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/geometry/camera.h"
#include "core/geometry/vec.h"

namespace rig::calibration {

/// A point of the sample frame and where it was seen.
struct Correspondence {
  int group = 0;  ///< points that stand or fall together: the id of their tag
  geometry::Vec3 sample_m;
  geometry::Vec2 pixel;
  double sigma_px = 1;  ///< standard deviation of the sighting
};

/// Covariance of (rx, ry, rz, tx, ty, tz), row-major: a small rotation vector (radians) in the camera frame
/// that turns the sample about its own origin, and the shift (metres) of that origin: camera_from_sample =
/// (exp([r]x) R, T + t).
using PoseCovariance = std::array<double, 36>;

struct PoseSolution {
  geometry::RigidTransform camera_from_sample;
  PoseCovariance covariance{};
  double rms_px = 0;          ///< distance between seen and projected points, those in use
  double unit_variance = 0;   ///< mean square of residual / sigma; near 1 where the sigmas are right
  std::vector<int> left_out;  ///< groups that contradict the rest, ascending
};

/// Weighted least squares over all points (Ceres, analytic derivatives). It starts at `nominal` and at both
/// solutions of the planar pose problem (Collins and Bartoli 2014), with Cauchy's loss; the best end is
/// taken. Groups whose residual is far beyond the others' are then left out one at a time, and the rest is
/// solved without the loss, which would bias the covariance. That is the inverse of J^T W J, times the unit
/// variance of the residuals. Fails on fewer than four points.
[[nodiscard]] base::Result<PoseSolution> solve_pose(const geometry::CameraIntrinsics& camera,
                                                    std::span<const Correspondence> points,
                                                    const geometry::RigidTransform& nominal);

/// Root mean square over a 9 x 9 grid of a width x height sample of the distance by which a point of the
/// plane is expected to be mistaken for another because of the pose's uncertainty: the image error it causes,
/// mapped back to the sample plane. Metres.
[[nodiscard]] double expected_registration_error_m(const geometry::CameraIntrinsics& camera,
                                                   const geometry::RigidTransform& camera_from_sample,
                                                   const PoseCovariance& covariance, double width_m,
                                                   double height_m);

/// The registration error proper: root mean square over the same grid of the distance, in the sample plane,
/// between each point and the point that `estimated` puts where `truth` sees it.
[[nodiscard]] double registration_error_m(const geometry::CameraIntrinsics& camera,
                                          const geometry::RigidTransform& estimated,
                                          const geometry::RigidTransform& truth, double width_m,
                                          double height_m);

}  // namespace rig::calibration
