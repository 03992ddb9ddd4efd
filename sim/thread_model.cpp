#include "sim/thread_model.h"

#include <algorithm>

namespace rig::sim {

namespace {

double gauss(double x, double width) {
  return std::exp(-0.5 * x * x / (width * width)) / (width * std::sqrt(2 * kPi));
}

// Scattering of one straight thread: longitudinal angles from the plane that the thread pierces, and the
// azimuth between the two directions around it.
double scatter(const Thread& t, V3 u, V3 wi, V3 wr, int channel) {
  const double sin_i = std::clamp(dot(wi, u), -1.0, 1.0);
  const double sin_r = std::clamp(dot(wr, u), -1.0, 1.0);
  const double theta_i = std::asin(sin_i);
  const double theta_r = std::asin(sin_r);
  const double theta_h = 0.5 * (theta_i + theta_r);
  const double theta_d = 0.5 * (theta_i - theta_r);
  const V3 pi = wi - sin_i * u;
  const V3 pr = wr - sin_r * u;
  const double lengths = std::max(1e-9, norm(pi) * norm(pr));
  const double cos_phi = std::clamp(dot(pi, pr) / lengths, -1.0, 1.0);
  const double cos_half = std::sqrt(0.5 * (1 + cos_phi));
  const double at_surface = t.surface * cos_half * gauss(theta_h, t.surface_width_rad);
  const double cosines = std::max(0.05, std::cos(theta_i) + std::cos(theta_r));
  const double inside = (1 - t.surface) * t.colour[static_cast<std::size_t>(channel)] *
                        ((1 - t.isotropic) * gauss(theta_h, t.volume_width_rad) + t.isotropic) / cosines;
  const double cos_d = std::max(0.2, std::cos(theta_d));
  return (at_surface + inside) / (cos_d * cos_d);
}

}  // namespace

double thread_brdf(const Thread& thread, V3 tangent, V3 wi, V3 wr, int channel) {
  if (wi.z <= 0 || wr.z <= 0) return 0;
  const double c = std::cos(thread.slope_rad);
  const double s = std::sin(thread.slope_rad);
  const V3 up{0, 0, 1};
  const double sum = scatter(thread, c * tangent + s * up, wi, wr, channel) +
                     scatter(thread, tangent, wi, wr, channel) +
                     scatter(thread, c * tangent - s * up, wi, wr, channel);
  // A third each, and 1 / (2 pi): keeps the directional albedo below one for every colour (see the tests).
  return sum / (6 * kPi);
}

}  // namespace rig::sim
