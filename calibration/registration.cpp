#include "calibration/registration.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/units.h"
#include "core/machine/kinematics.h"

namespace rig::calibration {

namespace {

using geometry::Vec2;
using geometry::Vec3;

// Standard deviation of the tags' centres along the direction in which they spread least.
double narrow_spread(const std::vector<const machine::Fiducial*>& tags) {
  const auto n = static_cast<double>(tags.size());
  double mx = 0, my = 0;
  for (const auto* tag : tags) mx += tag->x_m / n, my += tag->y_m / n;
  double xx = 0, xy = 0, yy = 0;
  for (const auto* tag : tags) {
    const double dx = tag->x_m - mx, dy = tag->y_m - my;
    xx += dx * dx / n, xy += dx * dy / n, yy += dy * dy / n;
  }
  const double least = 0.5 * (xx + yy) - std::hypot(0.5 * (xx - yy), xy);
  return std::sqrt(std::max(least, 0.0));
}

}  // namespace

geometry::RigidTransform nominal_camera_from_sample(const machine::RigConfig& rig,
                                                    const machine::JointAngles& angles) {
  return rig.camera.camera_from_bench * machine::bench_from_sample(rig.carrier, angles);
}

std::array<Vec3, 4> tag_corners(const machine::Fiducial& fiducial, double margin_m) {
  const double h = 0.5 * fiducial.size_m + margin_m;
  const double c = std::cos(fiducial.turn_rad), s = std::sin(fiducial.turn_rad);
  constexpr std::array<std::array<double, 2>, 4> kSigns{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  std::array<Vec3, 4> out;
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = h * kSigns[i][0], y = h * kSigns[i][1];
    out[i] = {fiducial.x_m + c * x - s * y, fiducial.y_m + s * x + c * y, 0};
  }
  return out;
}

PoseRegistration register_tags(const machine::RigConfig& rig, const geometry::RigidTransform& nominal,
                               const std::vector<TagSighting>& sightings, const RegistrationLimits& limits) {
  PoseRegistration out;
  std::map<int, const machine::Fiducial*> known;
  for (const machine::Fiducial& fiducial : rig.carrier.fiducials) known[fiducial.id] = &fiducial;
  std::map<int, int> times_seen;
  for (const TagSighting& sighting : sightings) ++times_seen[sighting.id];

  std::vector<Correspondence> points;
  for (const TagSighting& sighting : sightings) {
    const auto fiducial = known.find(sighting.id);
    if (fiducial == known.end() || times_seen[sighting.id] > 1) {
      if (out.left_out.empty() || out.left_out.back() != sighting.id) out.left_out.push_back(sighting.id);
      continue;
    }
    out.tags.push_back(sighting.id);
    const auto corners = tag_corners(*fiducial->second);
    for (std::size_t i = 0; i < 4; ++i) {
      points.push_back({sighting.id, corners[i], sighting.corners[i], sighting.corner_sigma_px[i]});
    }
  }
  const auto too_few = [&]() {
    out.reason = fmt::format("{} of the carrier's {} tags found, {} are needed", out.tags.size(),
                             known.size(), limits.least_tags);
    return out;
  };
  if (out.tags.size() < limits.least_tags) return too_few();

  const auto solution = solve_pose(rig.camera.intrinsics, points, nominal);
  if (!solution) {
    out.reason = solution.error().text();
    return out;
  }
  for (const int id : solution->left_out) {
    std::erase(out.tags, id);
    out.left_out.push_back(id);
  }
  std::sort(out.left_out.begin(), out.left_out.end());
  out.camera_from_sample = solution->camera_from_sample;
  out.covariance = solution->covariance;
  out.rms_px = solution->rms_px;
  out.expected_error_m =
      expected_registration_error_m(rig.camera.intrinsics, out.camera_from_sample, out.covariance,
                                    rig.carrier.sample_width_m, rig.carrier.sample_height_m);
  out.turn_rad = length(geometry::axis_angle_from_rotation(out.camera_from_sample.rotation *
                                                           geometry::transposed(nominal.rotation)));
  out.shift_m = length(out.camera_from_sample.translation - nominal.translation);
  if (out.tags.size() < limits.least_tags) return too_few();

  std::vector<const machine::Fiducial*> used, all;
  for (const int id : out.tags) used.push_back(known[id]);
  for (const machine::Fiducial& fiducial : rig.carrier.fiducials) all.push_back(&fiducial);
  const double spread = narrow_spread(used) / narrow_spread(all);
  if (spread < limits.least_spread) {
    out.reason = fmt::format(
        "the {} tags found lie nearly in a line or on one side (spread {:.0f} % of the carrier's, {:.0f} % "
        "needed)",
        used.size(), 100 * spread, 100 * limits.least_spread);
  } else if (!(out.rms_px <= limits.most_rms_px)) {
    out.reason = fmt::format(
        "the tags contradict each other by {:.2f} px, {:.2f} px are allowed; check tag positions and lens",
        out.rms_px, limits.most_rms_px);
  } else if (!(out.expected_error_m <= limits.most_expected_error_m)) {
    out.reason = fmt::format("the pose is uncertain by {:.3f} mm, {:.3f} mm are allowed",
                             base::mm_from_metres(out.expected_error_m),
                             base::mm_from_metres(limits.most_expected_error_m));
  } else if (out.turn_rad > limits.most_turn_rad || out.shift_m > limits.most_shift_m) {
    out.reason = fmt::format(
        "the carrier stands {:.2f} deg and {:.1f} mm from where the motors say, {:.1f} deg and {:.0f} mm are "
        "allowed",
        base::degrees(out.turn_rad), base::mm_from_metres(out.shift_m), base::degrees(limits.most_turn_rad),
        base::mm_from_metres(limits.most_shift_m));
  } else {
    out.registered = true;
  }
  return out;
}

}  // namespace rig::calibration
