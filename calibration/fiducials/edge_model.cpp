#include "calibration/fiducials/edge_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rig::calibration {

namespace {

// The blurred step and its first two antiderivatives at x, and the derivative of the second by the blur
// (which is blur * step, by Stein's lemma).
struct Ramp {
  double step, first, second;
};

Ramp ramp(double x, double blur) {
  const double u = x / blur;
  const double step = 0.5 * std::erfc(-u / std::numbers::sqrt2);
  const double density = std::exp(-0.5 * u * u) / std::sqrt(2 * std::numbers::pi);
  return {step, x * step + blur * density, 0.5 * ((x * x + blur * blur) * step + x * blur * density)};
}

}  // namespace

EdgeShare edge_share(double distance_px, geometry::Vec2 normal, double blur_px) {
  // A width of zero would divide by zero; one of 0.02 changes the share by less than 1e-4.
  const double a = std::max(std::abs(normal.x), 0.02);
  const double b = std::max(std::abs(normal.y), 0.02);
  const double outer = 0.5 * (a + b), inner = 0.5 * (a - b);
  if (distance_px > outer + 8 * blur_px) return {1, 0, 0};
  if (distance_px < -outer - 8 * blur_px) return {0, 0, 0};
  const Ramp p = ramp(distance_px + outer, blur_px), q = ramp(distance_px + inner, blur_px),
             r = ramp(distance_px - inner, blur_px), s = ramp(distance_px - outer, blur_px);
  const double scale = 1 / (a * b);
  return {scale * (p.second - q.second - r.second + s.second),
          scale * (p.first - q.first - r.first + s.first),
          scale * blur_px * (p.step - q.step - r.step + s.step)};
}

}  // namespace rig::calibration
