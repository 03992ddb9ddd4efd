// Moves to a position and by a distance.
#include <algorithm>
#include <cmath>

#include "core/base/units.h"
#include "drivers/ptu_axis/session.h"

namespace rig::drivers::ptu {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using Is = Steps::Is;

tl::unexpected<base::Error> Session::refused(const Axis& axis, const std::string& why,
                                             std::string hint) const {
  return fail(ErrorCode::refused, fmt::format("axis {} {}", axis.settings.axis.name, why), link_.path(),
              std::move(hint));
}

Result<void> Session::check_rates(const Axis& axis, double velocity, double acceleration) const {
  if (std::isfinite(velocity) && velocity > 0 && std::isfinite(acceleration) && acceleration > 0) return {};
  return fail(ErrorCode::bad_input, fmt::format("axis {} cannot move with {} rad/s and {} rad/s^2",
                                                axis.settings.axis.name, velocity, acceleration));
}

Result<void> Session::may_set_off(const Axis& axis) {
  if (auto ok = ready_for(axis, "move"); !ok) return ok;
  if (!axis.fault.empty())
    return refused(axis, "has a fault: " + axis.fault, "enable it again to acknowledge it");
  if (!axis.enabled) return refused(axis, "is not energised", "enable it first");
  return {};
}

Result<void> Session::move_to(std::size_t index, double target_rad, double velocity, double acceleration) {
  Axis& axis = axes_[index];
  const CountScale& scale = axis.settings.axis.scale;
  if (auto ok = check_rates(axis, velocity, acceleration); !ok) return ok;
  const auto target = scale.counts(target_rad);
  if (!target) return pass(target);
  if (auto ok = may_set_off(axis); !ok) return ok;
  if (!axis.homed) return refused(axis, "does not know where it stands", "home it first");
  if (settings_.limits != Limits::off && (*target < axis.low || *target > axis.high)) {
    const double low_deg = base::degrees(scale.radians(axis.low));
    const double high_deg = base::degrees(scale.radians(axis.high));
    const auto [a, b] = std::minmax(low_deg, high_deg);  // references
    return refused(axis,
                   fmt::format("cannot go to {:.4f} deg: the unit's travel is {:.4f} to {:.4f} deg",
                               base::degrees(target_rad), a, b),
                   {});
  }
  if (auto ok = keep_limits_again(); !ok) return ok;
  return start(index, *target, velocity, acceleration);
}

// As a target in the unit's own counting: repeated where a reply was lost, it is the same move.
Result<void> Session::move_by(std::size_t index, double delta_rad, double velocity, double acceleration) {
  Axis& axis = axes_[index];
  const CountScale& scale = axis.settings.axis.scale;
  if (auto ok = check_rates(axis, velocity, acceleration); !ok) return ok;
  const auto by = scale.distance(delta_rad);
  if (!by) return pass(by);
  if (auto ok = may_set_off(axis); !ok) return ok;
  if (auto ok = look(axis); !ok) return ok;
  if (axis.motion != Motion::rest) {
    return fail(ErrorCode::busy, fmt::format("axis {} moves", axis.settings.axis.name), link_.path(),
                "wait for its end, or stop it");
  }
  const auto target = scale.away_from(axis.position, delta_rad);
  if (!target) return pass(target);
  if (axis.homed && settings_.limits != Limits::off && (*target < axis.low || *target > axis.high)) {
    return refused(axis, "would leave the unit's travel", {});
  }
  if (!axis.homed && settings_.limits != Limits::off) {
    // They are about positions, and this one is worth nothing: a unit that was not reset may refuse all.
    if (auto ok = link_.order("LD"); !ok) return ok;
    limits_are_off_ = true;
  }
  // Known anew where it runs into its end stop.
  (delta_rad > 0 ? axis.at_low : axis.at_high) = false;
  return start(index, *target, velocity, acceleration);
}

Result<void> Session::keep_limits_again() {
  if (!limits_are_off_) return {};
  if (auto ok = link_.order(settings_.limits == Limits::user ? "LU" : "LE"); !ok) return ok;
  limits_are_off_ = false;
  return {};
}

Result<void> Session::start(std::size_t index, int target, double velocity, double acceleration) {
  Axis& axis = axes_[index];
  const AxisSettings& settings = axis.settings.axis;
  const auto speed = settings.scale.rate(std::min(velocity, settings.max_velocity_rad_s));
  if (!speed) return pass(speed);
  if (*speed < axis.slowest) {
    return fail(
        ErrorCode::bad_input,
        fmt::format("axis {} cannot be as slow as {:.4g} deg/s: the unit's lowest speed is {:.4g} deg/s",
                    settings.name, base::degrees(velocity),
                    base::degrees(axis.slowest / settings.scale.counts_per_rad)),
        link_.path());
  }
  const auto ramp = settings.scale.rate(std::min(acceleration, settings.max_acceleration_rad_s2));
  if (!ramp) return pass(ramp);
  axis.along = false;
  const Plan plan{target, std::min(*speed, axis.fastest)};
  if (*ramp == axis.acceleration) return go(axis, plan);

  const auto rest = all_at_rest();
  if (!rest) return pass(rest);
  if (!*rest) {
    return fail(ErrorCode::busy,
                fmt::format("axis {} takes no other acceleration while the unit moves", settings.name),
                link_.path(), "let max_acceleration_deg_s2 of the axis and of its module be the same");
  }
  axis.plan = plan;
  busy_ = {index};
  stopped_ = false;
  phase_ = Phase::tabling;
  add_acceleration(axis, *ramp);
  steps_.add([this, &axis]() -> Result<Is> {
    const auto planned = std::exchange(axis.plan, std::nullopt);
    if (!planned || stopped_) return Is::done;
    if (auto ok = go(axis, *planned); !ok) return pass(ok);
    return Is::done;
  });
  const auto begun = progress();
  if (!begun) return pass(begun);
  return {};
}

Result<void> Session::go(Axis& axis, Plan plan) {
  if (auto ok = link_.order(axis_command(axis, fmt::format("S{}", plan.speed))); !ok) return ok;
  // Whether it took a command that it did not answer shows only in whether it moves.
  doubt(axis, Motion::unknown);
  axis.direction = plan.target > axis.position ? 1 : -1;
  if (auto ok = link_.order(axis_command(axis, fmt::format("P{}", plan.target))); !ok) return ok;
  axis.target = plan.target;
  axis.motion = Motion::going;
  return {};
}

}  // namespace rig::drivers::ptu
