#include "daemon/motion.h"

#include <algorithm>
#include <cmath>

#include "core/base/units.h"
#include "core/machine/motion.h"
#include "daemon/following.h"
#include "daemon/safety.h"

namespace rig::daemon {

using base::degrees;
using base::seconds;

namespace {

// A move may take half as long again as its profile says, and two seconds for the drive's answer.
constexpr double kPatience = 1.5;
constexpr double kGrace_s = 2;
constexpr double kPollAgain_s = 0.02;

// For a reading, also where the other axes of the bus have their turn first: each may use its deadline twice.
double answer_s(const Setup& setup) {
  return 2 * static_cast<double>(kAxisCount) * setup.rig.deadlines.axis_s;
}

void expect(State& state, double predicted_s) {
  state.motion->poll_at = state.now + seconds(predicted_s);
  state.motion->deadline = state.now + seconds(kPatience * predicted_s + kGrace_s);
}

void home_next(const Setup& setup, State& state, Actions& actions) {
  Motion& motion = *state.motion;
  const std::size_t i = motion.to_home.front();
  const machine::AxisConfig& axis = setup.rig.axes[i];
  motion.involved = {};
  motion.involved[i] = true;
  state.axes[i].target_rad = axis.home_rad;
  actions.push_back(EnableAxis{i});
  actions.push_back(HomeAxis{i});
  expect(state, homing_time_s(setup, i));
  motion.poll_at = state.now + seconds(kPollAgain_s);
}

// Sends the axes on a leg and predicts its end.
void send_axes(const Setup& setup, State& state, Actions& actions, const JointAngles& to) {
  double longest = 0;
  state.motion->sent = state.now;
  state.motion->sent_after_poll = state.last_poll;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    state.motion->from_rad[i] = state.axes[i].last.position_rad;
    if (!state.motion->involved[i]) continue;
    const machine::AxisConfig& axis = setup.rig.axes[i];
    const double distance = to[i] - state.axes[i].last.position_rad;
    if (!state.axes[i].last.enabled) actions.push_back(EnableAxis{i});
    actions.push_back(MoveAxis{i, to[i], axis.max_velocity_rad_s, axis.max_acceleration_rad_s2});
    state.axes[i].target_rad = to[i];
    longest = std::max(
        longest, machine::travel_time_s(distance, axis.max_velocity_rad_s, axis.max_acceleration_rad_s2));
  }
  expect(state, longest);
}

std::optional<MotionEnd> end(State& state, std::string failure) {
  MotionEnd ended{state.motion->asker, state.motion->kind, std::move(failure)};
  state.motion.reset();
  return ended;
}

std::string not_there(const Setup& setup, const State& state) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!state.motion->involved[i]) continue;
    if (state.motion->kind == Motion::Kind::move && !state.axes[i].last.homed) {
      return fmt::format("axis {} lost its reference on the way", machine::kAxisNames[i]);
    }
    const double off = state.axes[i].last.position_rad - state.motion->target_rad[i];
    if (!(std::abs(off) <= setup.rig.axes[i].tolerance_rad)) {
      return fmt::format(
          "axis {} stands at {:.4f} deg after its move to {:.4f} deg; {:.4f} deg are tolerated",
          machine::kAxisNames[i], degrees(state.axes[i].last.position_rad),
          degrees(state.motion->target_rad[i]), degrees(setup.rig.axes[i].tolerance_rad));
    }
  }
  return {};
}

bool any_moving(const State& state) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (state.motion->involved[i] && state.axes[i].last.moving) return true;
  }
  return false;
}

std::optional<MotionEnd> evaluate_homing(const Setup& setup, State& state, Actions& actions) {
  Motion& motion = *state.motion;
  const drivers::AxisState& axis = state.axes[motion.to_home.front()].last;
  if (axis.moving || !axis.homed) {
    motion.poll_at = state.now + seconds(kPollAgain_s);
    return std::nullopt;
  }
  motion.to_home.erase(motion.to_home.begin());
  if (motion.to_home.empty()) return end(state, {});
  home_next(setup, state, actions);
  return std::nullopt;
}

std::optional<MotionEnd> evaluate_move(const Setup& setup, State& state, Actions& actions) {
  Motion& motion = *state.motion;
  if (any_moving(state)) {
    motion.poll_at = state.now + seconds(kPollAgain_s);
    return std::nullopt;
  }
  switch (motion.leg) {
    case Motion::Leg::detour:
      // Where the detour ended is only known now.
      if (auto ok = may_move(setup, state, motion.involved, motion.target_rad); !ok)
        return end(state, ok.error().text());
      motion.leg = Motion::Leg::target;
      send_axes(setup, state, actions, motion.target_rad);
      return std::nullopt;
    case Motion::Leg::target: {
      double settle = 0;
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        if (motion.involved[i]) settle = std::max(settle, setup.rig.axes[i].settle_s);
      }
      motion.leg = Motion::Leg::settle;
      expect(state, settle);
      return std::nullopt;
    }
    case Motion::Leg::settle:
      return end(state, not_there(setup, state));
  }
  return std::nullopt;
}

}  // namespace

bool all_homed(const State& state) {
  return std::all_of(state.axes.begin(), state.axes.end(),
                     [](const AxisTrack& axis) { return axis.last.homed; });
}

double homing_time_s(const Setup& setup, std::size_t axis) {
  const machine::AxisConfig& config = setup.rig.axes[axis];
  const double velocity = std::min(config.jog_velocity_rad_s,
                                   setup.homing_velocity_rad_s[axis].value_or(config.jog_velocity_rad_s));
  return machine::travel_time_s(config.max_rad - config.min_rad, velocity, config.max_acceleration_rad_s2);
}

void begin_homing(const Setup& setup, State& state, Actions& actions, std::vector<std::size_t> axes,
                  std::optional<Asker> asker) {
  state.motion = Motion{};
  state.motion->kind = Motion::Kind::homing;
  state.motion->to_home = std::move(axes);
  state.motion->asker = std::move(asker);
  home_next(setup, state, actions);
}

base::Result<void> begin_move(const Setup& setup, State& state, Actions& actions,
                              const std::array<bool, kAxisCount>& involved, const JointAngles& target_rad,
                              std::optional<Asker> asker) {
  if (auto ok = may_move(setup, state, involved, target_rad); !ok) return ok;
  Motion motion;
  motion.began = state.now;
  motion.involved = involved;
  motion.target_rad = target_rad;
  motion.asker = std::move(asker);
  JointAngles first = target_rad;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!involved[i]) continue;
    const auto legs = machine::plan_legs(setup.rig.axes[i], state.axes[i].last.position_rad, target_rad[i]);
    if (!legs.has_detour) continue;
    first[i] = legs.detour_rad;
    motion.leg = Motion::Leg::detour;
  }
  state.motion = std::move(motion);
  send_axes(setup, state, actions, first);
  return {};
}

base::Result<void> begin_jog(const Setup& setup, State& state, Actions& actions, std::size_t axis,
                             double by_rad, std::optional<Asker> asker) {
  if (auto ok = may_jog(setup, state, axis, by_rad); !ok) return ok;
  const machine::AxisConfig& config = setup.rig.axes[axis];
  const drivers::AxisState& here = state.axes[axis].last;
  Motion motion;
  motion.kind = Motion::Kind::jog;
  motion.began = state.now;
  motion.involved[axis] = true;
  motion.asker = std::move(asker);
  motion.sent = state.now;
  motion.sent_after_poll = state.last_poll;
  for (std::size_t i = 0; i < kAxisCount; ++i) motion.from_rad[i] = state.axes[i].last.position_rad;
  // In the axis' own counting, whatever that is worth.
  motion.target_rad[axis] = state.axes[axis].target_rad = here.position_rad + by_rad;
  state.motion = std::move(motion);
  if (!here.enabled) actions.push_back(EnableAxis{axis});
  actions.push_back(JogAxis{axis, by_rad, config.jog_velocity_rad_s, config.max_acceleration_rad_s2});
  expect(state, machine::travel_time_s(by_rad, config.jog_velocity_rad_s, config.max_acceleration_rad_s2));
  return {};
}

std::optional<MotionEnd> on_jog_refused(State& state, const JogRefused& refused) {
  if (!state.motion || state.motion->kind != Motion::Kind::jog || !state.motion->involved[refused.axis])
    return std::nullopt;
  auto ended = end(state, refused.what);
  ended->refused = true;
  return ended;
}

std::optional<MotionEnd> on_axis_polled(const Setup& setup, State& state, Actions& actions,
                                        const AxisPolled& polled) {
  AxisTrack& track = state.axes[polled.axis];
  if (polled.number <= track.outdated) return std::nullopt;
  if (!std::isfinite(polled.state.position_rad)) {
    track.known = false;
    if (state.stopped.empty()) {
      stop_everything(setup, state, actions,
                      fmt::format("axis {} reports no position", machine::kAxisNames[polled.axis]));
    }
    return std::nullopt;
  }
  const drivers::AxisState reading = with_limit_lines(state, polled.axis, polled.state);
  if (state.motion && state.motion->kind != Motion::Kind::homing && state.motion->involved[polled.axis] &&
      polled.number > state.motion->sent_after_poll) {
    std::string off = ran_into_switch(setup, state, polled.axis, reading);
    if (off.empty()) off = off_its_way(setup, state, polled.axis, reading);
    if (!off.empty()) {
      stop_everything(setup, state, actions, off);
      return std::nullopt;
    }
  }
  track.last = reading;
  track.drive_limits = {polled.state.at_low_limit, polled.state.at_high_limit};
  track.known = true;
  if (!track.last.fault.empty() && state.stopped.empty()) {
    stop_everything(setup, state, actions,
                    fmt::format("axis {}: {}", machine::kAxisNames[polled.axis], track.last.fault));
    return std::nullopt;
  }
  if (!state.motion || state.motion->awaited[polled.axis] != polled.number) return std::nullopt;
  Motion& motion = *state.motion;
  motion.awaited[polled.axis] = 0;
  if (answers_awaited(motion)) return std::nullopt;
  auto ended = motion.kind == Motion::Kind::homing ? evaluate_homing(setup, state, actions)
                                                   : evaluate_move(setup, state, actions);
  if (!ended && state.motion && state.now > state.motion->deadline) {
    std::string late;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (state.motion->involved[i]) late += fmt::format(" {}", machine::kAxisNames[i]);
    }
    stop_everything(setup, state, actions, fmt::format("the motion of{} did not end in time", late));
  }
  return ended;
}

bool answers_awaited(const Motion& motion) {
  return std::any_of(motion.awaited.begin(), motion.awaited.end(), [](std::uint64_t n) { return n != 0; });
}

void poll_motion(const Setup& setup, State& state, Actions& actions) {
  if (!state.motion) return;
  Motion& motion = *state.motion;
  if (answers_awaited(motion)) {
    if (state.now < motion.answer_by) return;
    std::string silent;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      if (motion.awaited[i] != 0) silent += fmt::format(" {}", machine::kAxisNames[i]);
    }
    stop_everything(setup, state, actions, "no answer from axis" + silent);
    return;
  }
  if (state.now < motion.poll_at) return;
  motion.answer_by = state.now + seconds(answer_s(setup));
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!motion.involved[i]) continue;
    motion.awaited[i] = ++state.last_poll;
    actions.push_back(PollAxis{i, state.last_poll});
  }
}

}  // namespace rig::daemon
