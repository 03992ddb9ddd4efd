#include "calibration/carrier_pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <ceres/ceres.h>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>

#include "calibration/projection.h"

namespace rig::calibration {

namespace {

using geometry::RigidTransform;
using geometry::Vec3;
using Matrix26 = Eigen::Matrix<double, 2, 6, Eigen::RowMajor>;
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

// Model errors (lens, flatness, printing) that no edge fit knows of; keeps one sharp tag from ruling the
// rest.
constexpr double kSigmaFloorPx = 0.01;
// A residual of this many sigmas begins to count less.
constexpr double kCauchyScale = 3;
// A group is an outlier beyond this multiple of the others' root mean square, and never below this many
// pixels.
constexpr double kOutlierFactor = 5;
constexpr double kOutlierPx = 0.3;
constexpr int kGridEdge = 9;

double weight(const Correspondence& point) {
  return 1 / std::hypot(point.sigma_px, kSigmaFloorPx);
}

// A step (rotation vector, shift) from a pose.
RigidTransform stepped(const RigidTransform& pose, const double* step) {
  return {geometry::rotation_from_axis_angle({step[0], step[1], step[2]}) * pose.rotation,
          pose.translation + Vec3{step[3], step[4], step[5]}};
}

// d(pixel)/d(rotation vector, shift) at a step of zero.
Matrix26 pixel_by_step(const Projection& p, Vec3 turned) {
  Matrix26 j;
  for (int i = 0; i < 2; ++i) {
    const auto row = static_cast<std::size_t>(3 * i);
    const Vec3 g{p.by_point[row], p.by_point[row + 1], p.by_point[row + 2]};
    // g . (r x turned) = r . (turned x g)
    const Vec3 by_rotation = geometry::cross(turned, g);
    j.row(i) << by_rotation.x, by_rotation.y, by_rotation.z, g.x, g.y, g.z;
  }
  return j;
}

// Residual of one point. Its parameters are the pose itself, 3 x 4 row-major, whose tangent is the step.
class PointCost : public ceres::SizedCostFunction<2, 12> {
 public:
  PointCost(const geometry::CameraIntrinsics& camera, const Correspondence& point)
      : camera_(camera), point_(point), weight_(weight(point)) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double* m = parameters[0];
    const Vec3 s = point_.sample_m;
    const Vec3 p{m[0] * s.x + m[1] * s.y + m[2] * s.z + m[3], m[4] * s.x + m[5] * s.y + m[6] * s.z + m[7],
                 m[8] * s.x + m[9] * s.y + m[10] * s.z + m[11]};
    const auto seen = project_with_derivatives(camera_, p);
    if (!seen) return false;
    residuals[0] = weight_ * (seen->pixel.x - point_.pixel.x);
    residuals[1] = weight_ * (seen->pixel.y - point_.pixel.y);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    const std::array<double, 4> by{s.x, s.y, s.z, 1};
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 4; ++c) {
          jacobians[0][12 * i + 4 * r + c] = weight_ * seen->by_point[3 * i + r] * by[c];
        }
      }
    }
    return true;
  }

 private:
  const geometry::CameraIntrinsics& camera_;
  Correspondence point_;
  double weight_;
};

void to_array(const RigidTransform& pose, double* m) {
  const std::array<double, 3> t{pose.translation.x, pose.translation.y, pose.translation.z};
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) m[4 * r + c] = pose.rotation(r, c);
    m[4 * r + 3] = t[static_cast<std::size_t>(r)];
  }
}

RigidTransform from_array(const double* m) {
  RigidTransform pose;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) pose.rotation(r, c) = m[4 * r + c];
  }
  pose.translation = {m[3], m[7], m[11]};
  return pose;
}

// The six-dimensional manifold of poses in their twelve numbers.
class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 12; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    to_array(stepped(from_array(x), delta), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 12, 6, Eigen::RowMajor>> j(jacobian);
    j.setZero();
    for (int c = 0; c < 3; ++c) {
      const Vec3 column{x[c], x[4 + c], x[8 + c]};
      const std::array<Vec3, 3> axes{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
      for (int a = 0; a < 3; ++a) {
        const Vec3 d = geometry::cross(axes[static_cast<std::size_t>(a)], column);
        j(c, a) = d.x;
        j(4 + c, a) = d.y;
        j(8 + c, a) = d.z;
      }
    }
    j(3, 3) = j(7, 4) = j(11, 5) = 1;
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    const RigidTransform a = from_array(y), b = from_array(x);
    const Vec3 r = geometry::axis_angle_from_rotation(a.rotation * geometry::transposed(b.rotation));
    const Vec3 t = a.translation - b.translation;
    const std::array<double, 6> d{r.x, r.y, r.z, t.x, t.y, t.z};
    std::copy(d.begin(), d.end(), y_minus_x);
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    // At y = x: the pseudo-inverse of PlusJacobian, whose columns are orthogonal (squared norms 2 and 1).
    Eigen::Matrix<double, 12, 6, Eigen::RowMajor> plus;
    PlusJacobian(x, plus.data());
    plus.leftCols<3>() *= 0.5;
    Eigen::Map<Eigen::Matrix<double, 6, 12, Eigen::RowMajor>> j(jacobian);
    j = plus.transpose();
    return true;
  }
};

struct Solved {
  RigidTransform pose;
  double cost = 0;
};

std::optional<Solved> minimise(const geometry::CameraIntrinsics& camera,
                               const std::vector<Correspondence>& points, const RigidTransform& start,
                               bool robust) {
  std::array<double, 12> pose{};
  to_array(start, pose.data());
  ceres::Problem problem;
  problem.AddParameterBlock(pose.data(), 12, new PoseManifold);
  for (const Correspondence& point : points) {
    problem.AddResidualBlock(new PointCost(camera, point),
                             robust ? new ceres::CauchyLoss(kCauchyScale) : nullptr, pose.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  return Solved{from_array(pose.data()), summary.final_cost};
}

// Both poses from which a plane looks nearly so.
std::vector<RigidTransform> planar_poses(const geometry::CameraIntrinsics& camera,
                                         const std::vector<Correspondence>& points) {
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  for (const Correspondence& point : points) {
    const auto ray = geometry::unproject(camera, point.pixel);
    if (!ray) continue;
    object.emplace_back(point.sample_m.x, point.sample_m.y, point.sample_m.z);
    image.emplace_back(ray->x, ray->y);
  }
  std::vector<RigidTransform> poses;
  if (object.size() < 4) return poses;
  std::vector<cv::Mat> rotations, translations;
  cv::solvePnPGeneric(object, image, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotations, translations,
                      false, cv::SOLVEPNP_IPPE);
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const auto vector = [](const cv::Mat& m) {
      return Vec3{m.at<double>(0), m.at<double>(1), m.at<double>(2)};
    };
    poses.push_back({geometry::rotation_from_axis_angle(vector(rotations[i])), vector(translations[i])});
  }
  return poses;
}

double squared_distance_px(const geometry::CameraIntrinsics& camera, const RigidTransform& pose,
                           const Correspondence& point) {
  const auto seen = geometry::project(camera, pose.point(point.sample_m));
  if (!seen) return 1e12;
  const double dx = seen->x - point.pixel.x, dy = seen->y - point.pixel.y;
  return dx * dx + dy * dy;
}

// The group that stands out from the others, if one does.
std::optional<int> outlier(const geometry::CameraIntrinsics& camera, const RigidTransform& pose,
                           const std::vector<Correspondence>& points) {
  struct Sum {
    double squares = 0;
    double count = 0;
  };
  std::map<int, Sum> groups;
  for (const Correspondence& point : points) {
    Sum& sum = groups[point.group];
    sum.squares += squared_distance_px(camera, pose, point);
    sum.count += 1;
  }
  if (groups.size() < 3) return std::nullopt;
  std::vector<double> means;
  int worst = 0;
  double worst_mean = -1;
  for (const auto& [id, sum] : groups) {
    const double mean = sum.squares / sum.count;
    means.push_back(mean);
    if (mean > worst_mean) worst = id, worst_mean = mean;
  }
  const auto middle = means.begin() + static_cast<std::ptrdiff_t>(means.size() / 2);
  std::nth_element(means.begin(), middle, means.end());
  const double limit = std::max(kOutlierPx, kOutlierFactor * std::sqrt(*middle));
  if (worst_mean <= limit * limit) return std::nullopt;
  return worst;
}

// J^T W J at a pose, in the tangent of PoseCovariance, and the sum of weighted squared residuals.
Matrix6 information(const geometry::CameraIntrinsics& camera, const RigidTransform& pose,
                    const std::vector<Correspondence>& points, double* weighted_squares) {
  Matrix6 sum = Matrix6::Zero();
  *weighted_squares = 0;
  for (const Correspondence& point : points) {
    const Vec3 turned = pose.direction(point.sample_m);
    const auto seen = project_with_derivatives(camera, turned + pose.translation);
    if (!seen) continue;
    const double w = weight(point);
    const Matrix26 j = w * pixel_by_step(*seen, turned);
    sum += j.transpose() * j;
    *weighted_squares += w * w * squared_distance_px(camera, pose, point);
  }
  return sum;
}

template <typename Body>
void over_grid(double width_m, double height_m, Body&& body) {
  for (int t = 0; t < kGridEdge; ++t) {
    for (int s = 0; s < kGridEdge; ++s) {
      body(Vec3{(static_cast<double>(s) / (kGridEdge - 1) - 0.5) * width_m,
                (static_cast<double>(t) / (kGridEdge - 1) - 0.5) * height_m, 0});
    }
  }
}

}  // namespace

base::Result<PoseSolution> solve_pose(const geometry::CameraIntrinsics& camera,
                                      std::span<const Correspondence> points, const RigidTransform& nominal) {
  if (points.size() < 4) {
    return base::fail(base::ErrorCode::bad_input,
                      fmt::format("a pose needs at least 4 points, not {}", points.size()));
  }
  PoseSolution solution;
  std::vector<Correspondence> used(points.begin(), points.end());
  std::vector<RigidTransform> starts = planar_poses(camera, used);
  starts.push_back(nominal);
  std::optional<Solved> best;
  for (const RigidTransform& start : starts) {
    const auto solved = minimise(camera, used, start, true);
    if (solved && (!best || solved->cost < best->cost)) best = solved;
  }
  if (!best) return base::fail(base::ErrorCode::bad_input, "no pose puts the points in front of the camera");

  while (const auto odd = outlier(camera, best->pose, used)) {
    std::erase_if(used, [odd](const Correspondence& point) { return point.group == *odd; });
    solution.left_out.push_back(*odd);
    const auto again = minimise(camera, used, best->pose, true);
    if (again) best = again;
  }
  std::sort(solution.left_out.begin(), solution.left_out.end());
  if (const auto last = minimise(camera, used, best->pose, false)) best = last;

  solution.camera_from_sample = best->pose;
  double squares = 0, weighted_squares = 0;
  for (const Correspondence& point : used) squares += squared_distance_px(camera, best->pose, point);
  const Matrix6 sum = information(camera, best->pose, used, &weighted_squares);
  const auto count = static_cast<double>(used.size());
  solution.rms_px = std::sqrt(squares / count);
  solution.unit_variance = weighted_squares / std::max(2 * count - 6, 1.0);
  const Matrix6 covariance = solution.unit_variance * sum.inverse();
  if (!covariance.allFinite()) {
    return base::fail(base::ErrorCode::bad_input, "the points do not determine the pose");
  }
  std::copy(covariance.data(), covariance.data() + 36, solution.covariance.begin());
  return solution;
}

double expected_registration_error_m(const geometry::CameraIntrinsics& camera,
                                     const RigidTransform& camera_from_sample,
                                     const PoseCovariance& covariance, double width_m, double height_m) {
  const Eigen::Map<const Matrix6> sigma(covariance.data());
  double sum = 0;
  int count = 0;
  over_grid(width_m, height_m, [&](Vec3 point) {
    const Vec3 turned = camera_from_sample.direction(point);
    const auto seen = project_with_derivatives(camera, turned + camera_from_sample.translation);
    const auto plane = project_from_plane(camera, camera_from_sample, point);
    if (!seen || !plane) return;
    const Eigen::Map<const Eigen::Matrix<double, 2, 2, Eigen::RowMajor>> by_plane(plane->by_plane.data());
    const Matrix26 plane_by_step = by_plane.inverse() * pixel_by_step(*seen, turned);
    sum += (plane_by_step * sigma * plane_by_step.transpose()).trace();
    ++count;
  });
  return std::sqrt(sum / std::max(count, 1));
}

double registration_error_m(const geometry::CameraIntrinsics& camera, const RigidTransform& estimated,
                            const RigidTransform& truth, double width_m, double height_m) {
  double sum = 0;
  int count = 0;
  over_grid(width_m, height_m, [&](Vec3 point) {
    const auto pixel = geometry::project(camera, truth.point(point));
    if (!pixel) return;
    const auto taken_for = geometry::intersect_plane(camera, estimated, *pixel);
    if (!taken_for) return;
    const Vec3 d = *taken_for - point;
    sum += dot(d, d);
    ++count;
  });
  return std::sqrt(sum / std::max(count, 1));
}

}  // namespace rig::calibration
