#include "daemon/safety.h"

#include <algorithm>
#include <cmath>

#include "core/machine/limits.h"
#include "core/machine/motion.h"
#include "daemon/job.h"
#include "daemon/lamp.h"
#include "daemon/messages.h"

namespace rig::daemon {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

// Two regular looks at the lines may pass before what they said is old.
constexpr double kLinesOld_s = 1;

// What holds of every move, whatever kind it is.
Result<void> rig_may_move(const Setup& setup, const State& state) {
  if (!state.stopped.empty()) {
    return fail(ErrorCode::refused, fmt::format("the rig is stopped: {}", state.stopped), {},
                "clear the stop first");
  }
  if (state.emergency_stop) return fail(ErrorCode::refused, "the emergency stop is active");
  if (!state.lost.empty()) {
    return fail(ErrorCode::refused, fmt::format("a device does not answer: {}", state.lost.begin()->second),
                {}, "it is looked for again and again");
  }
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisTrack& axis = state.axes[i];
    // Also those that stay: without a proven position nothing is known about distances.
    if (!axis.known || axis.last.moving) {
      return fail(ErrorCode::refused,
                  fmt::format("where axis {} stands is not known", machine::kAxisNames[i]), {},
                  "it is read again in a moment");
    }
  }
  return limit_lines_known(setup, state);
}

Result<void> has_no_fault(const State& state, std::size_t axis) {
  const std::string& fault = state.axes[axis].last.fault;
  if (fault.empty()) return {};
  return fail(ErrorCode::refused, fmt::format("axis {} has a fault: {}", machine::kAxisNames[axis], fault));
}

}  // namespace

drivers::AxisState with_limit_lines(const State& state, std::size_t axis, drivers::AxisState reading) {
  const auto& lines = state.limit_lines[axis];
  reading.at_low_limit = reading.at_low_limit || lines[kLow].active;
  reading.at_high_limit = reading.at_high_limit || lines[kHigh].active;
  return reading;
}

Result<void> limit_lines_known(const Setup& setup, const State& state) {
  const base::Duration oldest = base::seconds(setup.rig.deadlines.lines_s + kLinesOld_s);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    for (std::size_t end = 0; end < kEnds; ++end) {
      const InputTrack& line = state.limit_lines[i][end];
      if (!setup.rig.lines.limit[i][end] || (line.known && state.now - line.as_of <= oldest)) continue;
      return fail(ErrorCode::refused,
                  fmt::format("what the {} limit line of axis {} says is not known", machine::kEndNames[end],
                              machine::kAxisNames[i]),
                  {}, "it is read again in a moment");
    }
  }
  return {};
}

std::string ran_into_switch(const Setup& setup, const State& state, std::size_t axis,
                            const drivers::AxisState& reading) {
  const double tolerance_rad = setup.rig.axes[axis].tolerance_rad;
  const double way = state.axes[axis].target_rad - state.motion->from_rad[axis];
  const bool low = reading.at_low_limit && way < -tolerance_rad;
  if (!low && !(reading.at_high_limit && way > tolerance_rad)) return {};
  return fmt::format("axis {} ran into its {} limit switch", machine::kAxisNames[axis],
                     machine::kEndNames[low ? kLow : kHigh]);
}

std::string blocked_by_switch(const Setup& setup, const State& state, std::size_t axis, double target_rad) {
  const machine::AxisConfig& config = setup.rig.axes[axis];
  const drivers::AxisState& here = state.axes[axis].last;
  const auto legs = machine::plan_legs(config, here.position_rad, target_rad);
  const double first = legs.has_detour ? legs.detour_rad : target_rad;
  const bool down = first < here.position_rad - config.tolerance_rad;
  const bool up = first > here.position_rad + config.tolerance_rad;
  if ((here.at_low_limit && down) || (here.at_high_limit && up)) {
    return fmt::format("axis {} stands on its {} limit switch and would be driven further in",
                       machine::kAxisNames[axis], down ? "low" : "high");
  }
  return {};
}

Result<void> may_move(const Setup& setup, const State& state, const std::array<bool, kAxisCount>& involved,
                      const JointAngles& target_rad) {
  if (auto ok = rig_may_move(setup, state); !ok) return ok;
  JointAngles from{};
  JointAngles to{};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisTrack& axis = state.axes[i];
    if (!axis.last.homed) {
      return fail(ErrorCode::refused, fmt::format("axis {} is not homed", machine::kAxisNames[i]), {},
                  "home it first");
    }
    if (auto ok = has_no_fault(state, i); !ok) return ok;
    from[i] = axis.last.position_rad;
    to[i] = involved[i] ? target_rad[i] : axis.last.position_rad;
    if (involved[i]) {
      if (std::string blocked = blocked_by_switch(setup, state, i, to[i]); !blocked.empty()) {
        return fail(ErrorCode::refused, std::move(blocked), {},
                    "drive it out; if it is out, mend the switch");
      }
      if (auto ok = machine::check_axis_limit(setup.rig, static_cast<machine::AxisId>(i), to[i]); !ok)
        return ok;
    }
  }
  return machine::check_move(setup.rig, from, to);
}

Result<void> may_jog(const Setup& setup, const State& state, std::size_t axis, double by_rad) {
  if (auto ok = rig_may_move(setup, state); !ok) return ok;
  const machine::AxisConfig& config = setup.rig.axes[axis];
  const drivers::AxisState& here = state.axes[axis].last;
  const std::string_view name = machine::kAxisNames[axis];
  if (here.homed) {
    return fail(ErrorCode::refused, fmt::format("axis {} is homed", name), {}, "move it to an angle");
  }
  if (auto ok = has_no_fault(state, axis); !ok) return ok;
  const double most = std::min(kMostJog_rad, config.max_rad - config.min_rad);
  // Written so that NaN is refused too.
  if (!(std::abs(by_rad) <= most)) {
    return fail(ErrorCode::refused,
                fmt::format("before it is homed axis {} is moved by at most {:g} deg at a time", name,
                            base::degrees(most)));
  }
  if ((here.at_low_limit && by_rad < 0) || (here.at_high_limit && by_rad > 0)) {
    return fail(ErrorCode::refused,
                fmt::format("axis {} stands on its {} limit switch and would be driven further in", name,
                            by_rad < 0 ? "low" : "high"),
                {}, "drive it out; if it is out, mend the switch");
  }
  return {};
}

void stop_axes(State& state, Actions& actions) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    actions.push_back(StopAxis{i});
    AxisTrack& axis = state.axes[i];
    if (!axis.last.moving && !(state.motion && state.motion->involved[i])) continue;
    axis.known = false;
    axis.outdated = state.last_poll;
  }
  state.motion.reset();
  state.look_at = state.now;
}

void drop_all(const Setup& setup, State& state, Actions& actions, const std::string& reason) {
  const auto tell = [&](const Asker& asker) {
    actions.push_back(SendReply{asker.client, make_reply(asker.id, protocol::FAILED, "stopped: " + reason)});
  };
  if (state.motion && state.motion->asker) tell(*state.motion->asker);
  if (state.snap) tell(state.snap->asker);
  stop_axes(state, actions);
  make_light_safe(setup, actions);
  actions.push_back(AbortCamera{});
  state.frame.reset();
  state.snap.reset();
}

void stop_everything(const Setup& setup, State& state, Actions& actions, const std::string& reason) {
  drop_all(setup, state, actions, reason);
  if (state.job) {
    discard_takes(state, actions);
    state.job.reset();
  }
  if (!state.stopped.empty()) return;
  state.stopped = reason;
  actions.push_back(SaveStop{reason});
  protocol::Event event;
  event.mutable_stop_latched()->set_reason(reason);
  publish(state, actions, std::move(event));
}

Result<void> clear_stop(State& state, Actions& actions) {
  if (state.stopped.empty()) return fail(ErrorCode::refused, "no stop is latched");
  if (state.emergency_stop)
    return fail(ErrorCode::refused, "the emergency stop is still active", {}, "release it first");
  state.stopped.clear();
  state.last_alarm.clear();
  actions.push_back(SaveStop{});
  protocol::Event event;
  event.mutable_stop_cleared();
  publish(state, actions, std::move(event));
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    AxisTrack& axis = state.axes[i];
    if (!axis.known || axis.last.fault.empty()) continue;
    // A drive keeps its fault until somebody acknowledges it; readings from before must not stop the rig
    // anew.
    actions.push_back(EnableAxis{i});
    axis.outdated = state.last_poll;
    axis.known = false;
  }
  return {};
}

}  // namespace rig::daemon
