#include "calibration/fiducials/tag_edges.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/fiducials/edge_model.h"

namespace rig::calibration {

namespace {

using geometry::Vec2;

constexpr double kMostStripPx = 5;     // pixels farther off say nothing about the edge
constexpr double kLeastStripPx = 1.5;  // less does not show dark and bright
constexpr double kCellShare = 0.7;     // of the border's width that a strip may use
constexpr double kCornerMarginPx = 2;  // the next edge's blur begins there
constexpr double kMostShiftPx = 2;     // farther from the start it is some other edge
constexpr int kMostIterations = 30;

Vec2 operator+(Vec2 a, Vec2 b) {
  return {a.x + b.x, a.y + b.y};
}
Vec2 operator-(Vec2 a, Vec2 b) {
  return {a.x - b.x, a.y - b.y};
}
Vec2 operator*(double s, Vec2 a) {
  return {s * a.x, s * a.y};
}
double dot(Vec2 a, Vec2 b) {
  return a.x * b.x + a.y * b.y;
}

// A pixel of the strip: along the edge from -1 to 1, distance outward from the bent start line.
struct StripPixel {
  double along, distance, value;
};

// A line offset + slope * along, outward from the start line, with the covariance of both.
struct FittedLine {
  Vec2 normal;
  double offset = 0, slope = 0;
  Eigen::Matrix2d covariance;

  // Distance outward and its variance at one end, along = -1 or 1.
  [[nodiscard]] double at(double along) const { return offset + slope * along; }
  [[nodiscard]] double variance_at(double along) const {
    const Eigen::Vector2d g(1, along);
    return g.dot(covariance * g);
  }
};

// How far the image of the straight line between what two pixels see bulges along `normal` at its middle.
double bulge(const geometry::CameraIntrinsics* lens, Vec2 a, Vec2 b, Vec2 normal) {
  if (lens == nullptr) return 0;
  const auto ray_a = geometry::unproject(*lens, a), ray_b = geometry::unproject(*lens, b);
  if (!ray_a || !ray_b) return 0;
  const auto middle = geometry::project(*lens, 0.5 * (*ray_a + *ray_b));
  return middle ? dot(normal, *middle - 0.5 * (a + b)) : 0;
}

std::vector<StripPixel> strip_pixels(const GreyImage& image, Vec2 a, Vec2 b, Vec2 normal, double strip,
                                     double bulge_px) {
  const double length = std::hypot(b.x - a.x, b.y - a.y);
  const Vec2 tangent = (1 / length) * (b - a);
  const double reach = strip + 1;
  const int x0 = static_cast<int>(std::floor(std::min(a.x, b.x) - reach));
  const int x1 = static_cast<int>(std::ceil(std::max(a.x, b.x) + reach));
  const int y0 = static_cast<int>(std::floor(std::min(a.y, b.y) - reach));
  const int y1 = static_cast<int>(std::ceil(std::max(a.y, b.y) + reach));
  std::vector<StripPixel> pixels;
  for (int y = std::max(y0, 0); y <= std::min(y1, image.height - 1); ++y) {
    for (int x = std::max(x0, 0); x <= std::min(x1, image.width - 1); ++x) {
      const Vec2 p = Vec2{static_cast<double>(x), static_cast<double>(y)} - a;
      const double along_px = dot(p, tangent);
      if (along_px < kCornerMarginPx || along_px > length - kCornerMarginPx) continue;
      const double along = 2 * along_px / length - 1;
      const double distance = dot(p, normal) - bulge_px * (1 - along * along);
      if (std::abs(distance) > strip) continue;
      pixels.push_back({along, distance, static_cast<double>(image.at(x, y))});
    }
  }
  return pixels;
}

// Levenberg-Marquardt on offset, slope, dark, contrast, blur.
std::optional<FittedLine> fit_line(const std::vector<StripPixel>& pixels, Vec2 normal, double strip) {
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  if (pixels.size() < 20) return std::nullopt;
  double inside = 0, outside = 0;
  int inside_count = 0, outside_count = 0;
  for (const StripPixel& p : pixels) {
    if (p.distance < -0.5 * strip) inside += p.value, ++inside_count;
    if (p.distance > 0.5 * strip) outside += p.value, ++outside_count;
  }
  if (inside_count == 0 || outside_count == 0) return std::nullopt;
  Vector5 p;
  p << 0, 0, inside / inside_count, outside / outside_count - inside / inside_count, 0.5;
  if (p[3] <= 0) return std::nullopt;

  const auto build = [&](const Vector5& at, Matrix5* normal_matrix, Vector5* gradient, Matrix5* scatter) {
    double cost = 0;
    if (normal_matrix != nullptr) normal_matrix->setZero(), gradient->setZero();
    for (const StripPixel& pixel : pixels) {
      const double d = pixel.distance - at[0] - at[1] * pixel.along;
      const EdgeShare e = edge_share(d, normal, at[4]);
      const double residual = at[2] + at[3] * e.share - pixel.value;
      cost += residual * residual;
      if (normal_matrix == nullptr) continue;
      Vector5 j;
      j << -at[3] * e.by_distance, -at[3] * e.by_distance * pixel.along, 1, e.share, at[3] * e.by_blur;
      normal_matrix->selfadjointView<Eigen::Lower>().rankUpdate(j);
      *gradient += residual * j;
      if (scatter != nullptr) scatter->selfadjointView<Eigen::Lower>().rankUpdate(j, residual * residual);
    }
    return cost;
  };

  const double most_blur = strip;
  double damping = 1e-3;
  Matrix5 a;
  Vector5 g;
  double cost = build(p, &a, &g, nullptr);
  bool converged = false;
  for (int i = 0; i < kMostIterations && !converged; ++i) {
    Matrix5 damped = a.selfadjointView<Eigen::Lower>();
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-12;
    Vector5 next = p - damped.ldlt().solve(g);
    next[4] = std::clamp(next[4], 0.05, most_blur);
    const double next_cost = build(next, nullptr, nullptr, nullptr);
    if (!std::isfinite(next_cost)) return std::nullopt;
    if (next_cost > cost) {
      damping *= 10;
      converged = damping > 1e8;
      continue;
    }
    converged = std::abs(next[0] - p[0]) + std::abs(next[1] - p[1]) < 1e-4;
    p = next;
    damping = std::max(damping * 0.1, 1e-9);
    cost = build(p, &a, &g, nullptr);
  }
  if (!converged || std::abs(p[0]) + std::abs(p[1]) > kMostShiftPx || p[3] <= 0) return std::nullopt;

  // The noise is not even: pixels on the edge and on the bright side have more of it. The covariance that
  // allows for that is A^-1 (sum r^2 j j^T) A^-1 (White 1980). The blur at its lower bound leaves its column
  // near zero; it does not couple with the line, so a tiny ridge keeps the inverse of the rest right.
  Matrix5 scatter = Matrix5::Zero();
  (void)build(p, &a, &g, &scatter);
  Matrix5 full = a.selfadjointView<Eigen::Lower>();
  full.diagonal().array() += 1e-9 * full.diagonal().maxCoeff();
  const Matrix5 inverse = full.inverse();
  const auto n = static_cast<double>(pixels.size());
  const Matrix5 covariance =
      (n / (n - 5)) * inverse * Matrix5(scatter.selfadjointView<Eigen::Lower>()) * inverse;
  return FittedLine{normal, p[0], p[1], covariance.topLeftCorner<2, 2>()};
}

}  // namespace

std::optional<RefinedCorners> refine_corners(const GreyImage& image, const std::array<Vec2, 4>& corners,
                                             int cells, const geometry::CameraIntrinsics* lens) {
  double twice_area = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec2 a = corners[i], b = corners[(i + 1) % 4];
    twice_area += a.x * b.y - b.x * a.y;
  }
  const double orientation = twice_area > 0 ? 1 : -1;

  std::array<FittedLine, 4> lines;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec2 a = corners[i], b = corners[(i + 1) % 4];
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    if (length < 8) return std::nullopt;
    const Vec2 normal = (orientation / length) * Vec2{b.y - a.y, a.x - b.x};
    // The square's extent across this edge, at its narrower end, gives the width of its border.
    const double across =
        std::min(-dot(normal, corners[(i + 2) % 4] - b), -dot(normal, corners[(i + 3) % 4] - a));
    const double strip = std::min(kMostStripPx, kCellShare * across / cells);
    if (strip < kLeastStripPx) return std::nullopt;
    const std::vector<StripPixel> pixels =
        strip_pixels(image, a, b, normal, strip, bulge(lens, a, b, normal));
    const auto line = fit_line(pixels, normal, strip);
    if (!line) return std::nullopt;
    lines[i] = *line;
  }

  RefinedCorners out;
  for (std::size_t i = 0; i < 4; ++i) {
    // Corner i ends edge i-1 and begins edge i: solve n.(c - corner) = distance at that end for both. The
    // distances are taken where the start corner projects, the second pass where the found one does.
    const FittedLine& before = lines[(i + 3) % 4];
    const FittedLine& after = lines[i];
    const Vec2 previous = corners[(i + 3) % 4], here = corners[i], next = corners[(i + 1) % 4];
    const auto along = [](Vec2 a, Vec2 b, Vec2 p) {
      const Vec2 ab = b - a;
      return 2 * dot(p - a, ab) / dot(ab, ab) - 1;
    };
    Eigen::Matrix2d n;
    n << before.normal.x, before.normal.y, after.normal.x, after.normal.y;
    if (std::abs(n.determinant()) < 0.1) return std::nullopt;
    const Eigen::Matrix2d inverse = n.inverse();
    Vec2 corner = here;
    for (int pass = 0; pass < 3; ++pass) {
      const Eigen::Vector2d shift = inverse * Eigen::Vector2d(before.at(along(previous, here, corner)),
                                                              after.at(along(here, next, corner)));
      corner = here + Vec2{shift[0], shift[1]};
    }
    out.corners[i] = corner;
    const Eigen::Vector2d variances(before.variance_at(1), after.variance_at(-1));
    const Eigen::Matrix2d covariance = inverse * variances.asDiagonal() * inverse.transpose();
    out.sigma_px[i] = std::sqrt(0.5 * covariance.trace());
  }
  return out;
}

}  // namespace rig::calibration
