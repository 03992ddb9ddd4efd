#include "clients/plan/pair_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/units.h"
#include "core/geometry/directions.h"

namespace rig::plan {

namespace {

// The squared angle whose squared chord is u; convex and increasing, and never less than u.
double squared_angle(double u) {
  const double angle = 2 * std::asin(std::min(1.0, 0.5 * std::sqrt(std::max(0.0, u))));
  return angle * angle;
}

// Two pairs, one turned by psi about the normal: the squared chords between their directions are
// first - 2 p cos(psi) and second - 2 q cos(psi + delta).
struct Turning {
  double first, second;
  double p, q;
  double delta;

  [[nodiscard]] double squared(double psi) const {
    return squared_angle(first - 2 * p * std::cos(psi)) +
           squared_angle(second - 2 * q * std::cos(psi + delta));
  }
  // The sum of the chords is first + second - 2 r cos(psi - best): its minimum bounds the distance from
  // below.
  [[nodiscard]] double amplitude() const {
    return std::sqrt(std::max(0.0, p * p + q * q + 2 * p * q * std::cos(delta)));
  }
  [[nodiscard]] double best() const { return -std::atan2(q * std::sin(delta), p + q * std::cos(delta)); }
};

// Minimum over psi. Chords bound angles, so that the minimum lies where the sum of the squared chords does
// not exceed the squared distance at the chords' own minimum: there it is scanned, then refined by golden
// section.
double least_squared(const Turning& t) {
  const double r = t.amplitude();
  const double centre = t.best();
  double least = t.squared(centre);
  const double cosine = r > 0 ? (t.first + t.second - least) / (2 * r) : -1;
  const double width = cosine >= 1 ? 0 : cosine <= -1 ? base::kPi : std::acos(cosine);
  if (width == 0) return least;
  constexpr int kScan = 32;
  const double step = 2 * width / kScan;
  double best = centre;
  for (int i = 0; i <= kScan; ++i) {
    const double psi = centre - width + i * step;
    if (const double s = t.squared(psi); s < least) {
      least = s;
      best = psi;
    }
  }
  double low = best - step;
  double high = best + step;
  constexpr double kGolden = 1 / std::numbers::phi;
  constexpr int kRefine = 48;  // 0.618^48 of the bracket
  for (int i = 0; i < kRefine; ++i) {
    const double a = high - kGolden * (high - low);
    const double b = low + kGolden * (high - low);
    if (t.squared(a) < t.squared(b)) {
      high = b;
    } else {
      low = a;
    }
  }
  return std::min(least, t.squared(0.5 * (low + high)));
}

}  // namespace

IsotropicPair::IsotropicPair(double incident_rad, double exitant_rad, double azimuth_rad)
    : incident_rad_(incident_rad),
      exitant_rad_(exitant_rad),
      azimuth_rad_(azimuth_rad),
      cos_i_(std::cos(incident_rad)),
      sin_i_(std::sin(incident_rad)),
      cos_r_(std::cos(exitant_rad)),
      sin_r_(std::sin(exitant_rad)) {}

IsotropicPair::IsotropicPair(const machine::DirectionPair& pair)
    : IsotropicPair(geometry::polar_from_direction(pair.incident).theta_rad,
                    geometry::polar_from_direction(pair.exitant).theta_rad,
                    std::abs(std::remainder(geometry::polar_from_direction(pair.exitant).phi_rad -
                                                geometry::polar_from_direction(pair.incident).phi_rad,
                                            2 * base::kPi))) {}

double IsotropicPair::between_rad() const {
  const geometry::Vec3 incident{sin_i_, 0, cos_i_};
  const geometry::Vec3 exitant{sin_r_ * std::cos(azimuth_rad_), sin_r_ * std::sin(azimuth_rad_), cos_r_};
  return geometry::angle_between(incident, exitant);
}

double pair_distance(const IsotropicPair& a, const IsotropicPair& b) {
  double least = std::numeric_limits<double>::infinity();
  for (const double azimuth : {b.azimuth_rad_, -b.azimuth_rad_}) {
    const double delta = azimuth - a.azimuth_rad_;
    const Turning same{2 - 2 * a.cos_i_ * b.cos_i_, 2 - 2 * a.cos_r_ * b.cos_r_, a.sin_i_ * b.sin_i_,
                       a.sin_r_ * b.sin_r_, delta};
    const Turning exchanged{2 - 2 * a.cos_i_ * b.cos_r_, 2 - 2 * a.cos_r_ * b.cos_i_, a.sin_i_ * b.sin_r_,
                            a.sin_r_ * b.sin_i_, delta};
    least = std::min({least, least_squared(same), least_squared(exchanged)});
  }
  return std::sqrt(least);
}

bool nearer_than(const IsotropicPair& a, const IsotropicPair& b, double limit_rad) {
  const double limit = limit_rad * limit_rad;
  // Both angles grow with the turn that separates their directions, and the two turns add up to delta; so of
  // the two mirror images the one with the smaller delta is nearer.
  const auto near = [&](double cos_i, double sin_i, double cos_r, double sin_r, double delta) {
    const Turning t{2 - 2 * a.cos_i_ * cos_i, 2 - 2 * a.cos_r_ * cos_r, a.sin_i_ * sin_i, a.sin_r_ * sin_r,
                    delta};
    const double lower = t.first + t.second - 2 * t.amplitude();
    if (lower > limit) return false;
    return t.squared(t.best()) <= limit || least_squared(t) <= limit;
  };
  const double delta = std::abs(b.azimuth_rad_ - a.azimuth_rad_);
  return near(b.cos_i_, b.sin_i_, b.cos_r_, b.sin_r_, delta) ||
         near(b.cos_r_, b.sin_r_, b.cos_i_, b.sin_i_, delta);
}

}  // namespace rig::plan
