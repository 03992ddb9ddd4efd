#include "core/machine/limits.h"

#include <algorithm>
#include <cmath>

#include "core/base/units.h"
#include "core/machine/kinematics.h"
#include "core/machine/motion.h"

namespace rig::machine {

using base::ErrorCode;
using base::fail;
using geometry::Vec3;

namespace {

// A body at one pose: a sphere, or a disc given as centre, unit normal and radius.
struct Body {
  Vec3 centre;
  Vec3 normal;
  double radius_m = 0;
  bool disc = false;
};

Body body_at(const RigConfig& rig, const std::string& name, const JointAngles& angles) {
  if (name == "light") return {light_in_bench(rig.light, angles), {}, rig.bodies.light_radius_m, false};
  if (name == "camera") return {camera_in_bench(rig.camera), {}, rig.bodies.camera_radius_m, false};
  const auto carrier = bench_from_sample(rig.carrier, angles);
  return {carrier.translation, carrier.direction({0, 0, 1}), rig.bodies.carrier_radius_m, true};
}

double distance_to_disc(const Body& disc, Vec3 point) {
  const Vec3 offset = point - disc.centre;
  const double height = dot(offset, disc.normal);
  const double radial = length(offset - height * disc.normal);
  return std::hypot(height, std::max(0.0, radial - disc.radius_m));
}

// Free distance between the surfaces; for a pair of discs (not configurable) the bounding spheres.
double clearance(const Body& a, const Body& b) {
  if (a.disc && !b.disc) return distance_to_disc(a, b.centre) - b.radius_m;
  if (b.disc && !a.disc) return distance_to_disc(b, a.centre) - a.radius_m;
  return length(a.centre - b.centre) - a.radius_m - b.radius_m;
}

// How far any point of a body travels at most for these joint steps.
double travel_bound(const RigConfig& rig, const std::string& name, const JointAngles& step) {
  if (name == "camera") return 0;
  if (name == "light") return rig.light.arm_radius_m * std::abs(step[static_cast<std::size_t>(AxisId::arm)]);
  const double reach = std::hypot(rig.bodies.carrier_radius_m, rig.carrier.plane_offset_m);
  return reach * (std::abs(step[0]) + std::abs(step[1]) + std::abs(step[2]));
}

// Whether a rule holds everywhere in the box centre +- half: by bounding how far the bodies can get, and
// halving the box along its widest side where the bound does not decide.
bool holds_in_box(const RigConfig& rig, const KeepOut& rule, const JointAngles& centre,
                  const JointAngles& half, int depth) {
  const double free =
      clearance(body_at(rig, rule.first, centre), body_at(rig, rule.second, centre)) - rule.clearance_m;
  if (!(free >= 0)) return false;
  const double reach = travel_bound(rig, rule.first, half) + travel_bound(rig, rule.second, half);
  if (reach <= free) return true;
  constexpr int kDeepest = 24;
  if (depth >= kDeepest) return false;  // too close to tell apart: refused
  // Axes that move neither body do not matter to the rule.
  std::size_t widest = 0;
  double widest_reach = -1;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    JointAngles one{};
    one[i] = half[i];
    const double r = travel_bound(rig, rule.first, one) + travel_bound(rig, rule.second, one);
    if (r > widest_reach) {
      widest = i;
      widest_reach = r;
    }
  }
  JointAngles smaller = half;
  smaller[widest] *= 0.5;
  JointAngles low = centre;
  JointAngles high = centre;
  low[widest] -= smaller[widest];
  high[widest] += smaller[widest];
  return holds_in_box(rig, rule, low, smaller, depth + 1) &&
         holds_in_box(rig, rule, high, smaller, depth + 1);
}

std::string in_degrees(const JointAngles& angles) {
  std::string out;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    out += fmt::format("{}{} {:.3f}", i == 0 ? "" : ", ", kAxisNames[i], base::degrees(angles[i]));
  }
  return out + " deg";
}

base::Result<void> check_axes(const RigConfig& rig, const JointAngles& angles) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (auto ok = check_axis_limit(rig, static_cast<AxisId>(i), angles[i]); !ok) return ok;
  }
  return {};
}

}  // namespace

base::Result<void> check_axis_limit(const RigConfig& rig, AxisId axis, double angle_rad) {
  const auto i = static_cast<std::size_t>(axis);
  const AxisConfig& config = rig.axes[i];
  // Written so that NaN is refused.
  if (angle_rad >= config.min_rad && angle_rad <= config.max_rad) return {};
  return fail(
      ErrorCode::refused,
      fmt::format("axis {} may not go to {:.4f} deg: its limits are {:.4f} to {:.4f} deg", kAxisNames[i],
                  base::degrees(angle_rad), base::degrees(config.min_rad), base::degrees(config.max_rad)));
}

base::Result<void> check_standing(const RigConfig& rig, const JointAngles& angles) {
  if (auto ok = check_axes(rig, angles); !ok) return ok;
  for (const KeepOut& rule : rig.keep_out) {
    const double free = clearance(body_at(rig, rule.first, angles), body_at(rig, rule.second, angles));
    if (!(free >= rule.clearance_m)) {
      return fail(
          ErrorCode::refused,
          fmt::format(
              "keep-out '{}': {} and {} would be {:.1f} mm apart at {}, at least {:.1f} mm are required",
              rule.name, rule.first, rule.second, base::mm_from_metres(free), in_degrees(angles),
              base::mm_from_metres(rule.clearance_m)));
    }
  }
  return {};
}

base::Result<void> check_move(const RigConfig& rig, const JointAngles& from, const JointAngles& to) {
  if (auto ok = check_standing(rig, to); !ok) return ok;
  JointAngles centre{};
  JointAngles half{};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!std::isfinite(from[i])) {
      return fail(ErrorCode::refused, fmt::format("the position of axis {} is not known", kAxisNames[i]));
    }
    // The detour of a one-sided approach is part of the way.
    const AxisLegs legs = plan_legs(rig.axes[i], from[i], to[i]);
    const double lowest = std::min({from[i], to[i], legs.has_detour ? legs.detour_rad : to[i]});
    const double highest = std::max(from[i], to[i]);
    centre[i] = 0.5 * (lowest + highest);
    half[i] = 0.5 * (highest - lowest);
  }
  for (const KeepOut& rule : rig.keep_out) {
    if (!holds_in_box(rig, rule, centre, half, 0)) {
      return fail(
          ErrorCode::refused,
          fmt::format("keep-out '{}': on the way from {} to {}, {} and {} could come closer than {:.1f} mm",
                      rule.name, in_degrees(from), in_degrees(to), rule.first, rule.second,
                      base::mm_from_metres(rule.clearance_m)));
    }
  }
  return {};
}

}  // namespace rig::machine
