#include "share/examples/driver/axis.h"

#include <algorithm>

#include "share/examples/driver/protocol.h"

namespace rig::drivers::turner {

using base::pass;

AxisCapabilities TurnerAxis::capabilities() const {
  AxisCapabilities capabilities;
  capabilities.resolution_rad = settings_.scale.resolution_rad();
  capabilities.max_velocity_rad_s = settings_.max_velocity_rad_s;
  capabilities.max_acceleration_rad_s2 = settings_.max_acceleration_rad_s2;
  capabilities.has_limit_switches = true;
  return capabilities;
}

Result<void> TurnerAxis::enable(bool on) {
  return order(on ? "E 1" : "E 0");
}

Result<void> TurnerAxis::home() {
  return order("H");
}

Result<void> TurnerAxis::move_to(double target_rad, double velocity_rad_s, double acceleration_rad_s2) {
  const auto target = settings_.scale.counts(target_rad);
  if (!target) return pass(target);
  const auto velocity = settings_.scale.rate(std::min(velocity_rad_s, settings_.max_velocity_rad_s));
  if (!velocity) return pass(velocity);
  const auto acceleration =
      settings_.scale.rate(std::min(acceleration_rad_s2, settings_.max_acceleration_rad_s2));
  if (!acceleration) return pass(acceleration);
  // The controller itself refuses an absolute move before it has been homed.
  return order(fmt::format("M {} {} {}", *target, *velocity, *acceleration));
}

Result<void> TurnerAxis::stop() {
  return order("S");
}

Result<AxisState> TurnerAxis::state() {
  const auto told = link_.ask("Q", [](const std::string& answer) { return report(answer); });
  if (!told) return pass(told);
  AxisState state;
  state.position_rad = settings_.scale.radians(told->counts);
  state.enabled = told->energised;
  state.moving = told->moving;
  state.homed = told->homed;
  // Low and high are the axis' sides, not the motor's.
  state.at_low_limit = settings_.scale.reversed ? told->at_high_limit : told->at_low_limit;
  state.at_high_limit = settings_.scale.reversed ? told->at_low_limit : told->at_high_limit;
  if (told->fault) state.fault = "the motor is overloaded";
  return state;
}

Result<void> TurnerAxis::order(std::string_view text) {
  return link_.ask(text, [text](const std::string& answer) { return verdict(text.front(), answer); });
}

}  // namespace rig::drivers::turner
