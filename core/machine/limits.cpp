#include "core/machine/limits.h"

#include <algorithm>
#include <cmath>
#include <utility>

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

// Free distance between the surfaces. Two discs cannot meet here: there is one carrier.
double clearance(const RigConfig& rig, const KeepOut& rule, const JointAngles& angles) {
  const Body a = body_at(rig, rule.first, angles);
  const Body b = body_at(rig, rule.second, angles);
  if (a.disc) return distance_to_disc(a, b.centre) - b.radius_m;
  if (b.disc) return distance_to_disc(b, a.centre) - a.radius_m;
  return length(a.centre - b.centre) - a.radius_m - b.radius_m;
}

// All joint angles from centre - half to centre + half.
struct Box {
  JointAngles centre{};
  JointAngles half{};
};

constexpr auto kRoll = static_cast<std::size_t>(AxisId::roll);
constexpr auto kPan = static_cast<std::size_t>(AxisId::pan);
constexpr auto kArm = static_cast<std::size_t>(AxisId::arm);

// The same question with fewer axes: no body changes under roll, and pan and arm turn about one line, so that
// light and carrier only see their difference.
Box reduced(const KeepOut& rule, Box box) {
  box.centre[kRoll] = 0;
  box.half[kRoll] = 0;
  if (rule.first != "camera" && rule.second != "camera") {
    box.centre[kArm] -= std::exchange(box.centre[kPan], 0.0);
    box.half[kArm] += std::exchange(box.half[kPan], 0.0);
  }
  return box;
}

// How far any point of either body travels at most when one axis turns by so much.
double travel_bound(const RigConfig& rig, const KeepOut& rule, std::size_t axis, double angle_rad) {
  const auto involves = [&rule](std::string_view body) { return rule.first == body || rule.second == body; };
  if (axis == kArm) return involves("light") ? rig.light.arm_radius_m * angle_rad : 0;
  if (axis == kRoll || !involves("carrier")) return 0;
  return std::hypot(rig.bodies.carrier_radius_m, rig.carrier.plane_offset_m) * angle_rad;
}

// Boxes in which no body travels farther than this and that still cannot be told free are refused.
constexpr double kResolution_m = 1e-4;

// Whether a rule holds everywhere in a box: by bounding how far the bodies get from where they are at its
// centre, and halving it along the axis that takes them farthest where the bound does not decide.
bool holds_in(const RigConfig& rig, const KeepOut& rule, const Box& box) {
  const double free = clearance(rig, rule, box.centre) - rule.clearance_m;
  if (!(free >= 0)) return false;
  double reach = 0;
  double widest_reach = -1;
  std::size_t widest = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const double r = travel_bound(rig, rule, i, box.half[i]);
    reach += r;
    if (r > widest_reach) {
      widest = i;
      widest_reach = r;
    }
  }
  if (reach <= free) return true;
  if (reach < kResolution_m) return false;
  Box low = box;
  low.half[widest] *= 0.5;
  Box high = low;
  low.centre[widest] -= low.half[widest];
  high.centre[widest] += high.half[widest];
  return holds_in(rig, rule, low) && holds_in(rig, rule, high);
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
    const double free = clearance(rig, rule, angles);
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
  Box way;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!std::isfinite(from[i])) {
      return fail(ErrorCode::refused, fmt::format("the position of axis {} is not known", kAxisNames[i]));
    }
    // The detour of a one-sided approach is part of the way.
    const AxisLegs legs = plan_legs(rig.axes[i], from[i], to[i]);
    const double lowest = std::min({from[i], to[i], legs.has_detour ? legs.detour_rad : to[i]});
    const double highest = std::max(from[i], to[i]);
    way.centre[i] = 0.5 * (lowest + highest);
    way.half[i] = 0.5 * (highest - lowest);
  }
  for (const KeepOut& rule : rig.keep_out) {
    if (!holds_in(rig, rule, reduced(rule, way))) {
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
