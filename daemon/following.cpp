#include "daemon/following.h"

#include <algorithm>
#include <cmath>

#include "core/base/units.h"
#include "core/machine/motion.h"

namespace rig::daemon {

using base::degrees;

namespace {

// An axis that is not homed goes at its reduced speed.
double sent_velocity(const Setup& setup, const State& state, std::size_t axis) {
  const machine::AxisConfig& config = setup.rig.axes[axis];
  return state.motion->kind == Motion::Kind::jog ? config.jog_velocity_rad_s : config.max_velocity_rad_s;
}

// The predicted position, `t_s` after the axis set out.
double predicted(const Setup& setup, const State& state, std::size_t axis, double t_s) {
  const machine::AxisConfig& config = setup.rig.axes[axis];
  const double from = state.motion->from_rad[axis];
  const double way = state.axes[axis].target_rad - from;
  if (std::abs(way) <= config.tolerance_rad) return state.axes[axis].target_rad;
  return from + way * machine::travel_share(way, sent_velocity(setup, state, axis),
                                            config.max_acceleration_rad_s2, t_s);
}

}  // namespace

std::string off_its_way(const Setup& setup, const State& state, std::size_t axis,
                        const drivers::AxisState& reading) {
  const machine::AxisConfig& config = setup.rig.axes[axis];
  const Motion& motion = *state.motion;
  const std::string_view name = machine::kAxisNames[axis];
  const double since_s = base::to_seconds(state.now - motion.sent);
  const double newest = predicted(setup, state, axis, since_s);
  const double oldest = predicted(setup, state, axis, since_s - setup.rig.deadlines.axis_s);
  const auto [low, high] = std::minmax(newest, oldest);
  const double here = reading.position_rad;
  if (here >= low - config.following_rad && here <= high + config.following_rad) return {};
  const bool stands = std::abs(here - state.axes[axis].last.position_rad) <= config.tolerance_rad;
  return fmt::format("axis {} {} {:.3f} deg, where {:.3f} deg to {:.3f} deg were predicted", name,
                     stands ? "stalled at" : "is off its way at", degrees(here), degrees(low), degrees(high));
}

}  // namespace rig::daemon
