#include "clients/rig/axis_drive.h"

#include <cmath>

#include "clients/rig/ask.h"
#include "core/base/interrupt.h"

namespace rig::client {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

// Whoever interrupts a movement wants it to end, not only this program.
Result<void> or_stopped(const Connection& to, Result<void> moved) {
  if (moved || moved.error().code != ErrorCode::interrupted) return moved;
  if (auto stopped = stop(to, "rig axis setup was interrupted"); !stopped) return stopped;
  return base::interrupted_error(
      "every axis was stopped, rig.toml is as it was; `rig clear` lets them move again");
}

}  // namespace

AxisDrive::AxisDrive(Connection to, std::string axis, double tolerance_deg, const Dialogue& dialogue)
    : to_(std::move(to)), axis_(std::move(axis)), tolerance_deg_(tolerance_deg), dialogue_(&dialogue) {}

Result<protocol::AxisStatus> AxisDrive::look() {
  protocol::Request request;
  request.mutable_get_status();
  const auto reply = ask(to_, request, to_.wait_s);
  if (!reply) return pass(reply);
  rig_ = reply->status();
  for (const auto& axis : rig_.axes()) {
    if (axis.name() == axis_) return axis;
  }
  return fail(ErrorCode::not_found, fmt::format("rigd has no axis '{}'", axis_));
}

Result<double> AxisDrive::position() {
  const auto axis = look();
  if (!axis) return pass(axis);
  return axis->position_deg();
}

std::vector<std::string> AxisDrive::not_homed() const {
  std::vector<std::string> axes;
  for (const auto& axis : rig_.axes()) {
    if (!axis.homed()) axes.push_back(axis.name());
  }
  return axes;
}

Result<void> AxisDrive::home() const {
  return or_stopped(to_, client::home(to_, {axis_}));
}

Result<void> AxisDrive::home_all() const {
  return or_stopped(to_, client::home(to_, {}));
}

Result<bool> AxisDrive::jog(double by_deg) const {
  dialogue_->say(fmt::format("  moves by {:g} deg ...", by_deg));
  const auto moved = or_stopped(to_, client::jog(to_, axis_, by_deg));
  if (moved) return true;
  if (moved.error().code != ErrorCode::refused) return pass(moved);
  dialogue_->say("  " + moved.error().text());
  return false;
}

Result<std::optional<double>> AxisDrive::go_to(double angle_deg) {
  const auto before = position();
  if (!before) return pass(before);
  if (std::abs(*before - angle_deg) <= tolerance_deg_) return *before;
  dialogue_->say(fmt::format("  moves to {:.3f} deg ...", angle_deg));
  const auto moved = or_stopped(to_, move(to_, {{axis_, angle_deg}}));
  if (!moved && moved.error().code == ErrorCode::refused) {
    dialogue_->say("  " + moved.error().text());
    return std::nullopt;
  }
  if (!moved) return pass(moved);
  const auto now = position();
  if (!now) return pass(now);
  return *now;
}

}  // namespace rig::client
