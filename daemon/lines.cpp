#include "daemon/lines.h"

#include <algorithm>

#include "daemon/safety.h"

namespace rig::daemon {

using base::seconds;

namespace {

constexpr double kLookEvery_s = 0.05;
constexpr double kLooksPerBound = 4;  // at least, in the time that a reading may be old

// A drive finds its own reference, and may have to run onto its switch for that.
bool minds_switches(const Motion& motion) {
  return motion.kind != Motion::Kind::homing;
}

}  // namespace

void ask_lines(const Setup& setup, State& state, Actions& actions) {
  const machine::LinesConfig& lines = setup.rig.lines;
  if (machine::line_parts(lines).empty()) return;
  state.lines_asked = state.now;
  actions.push_back(ReadLines{state.now});
}

void on_lines_read(const Setup& setup, State& state, Actions& actions, const LinesRead& read) {
  state.lost.erase(read.device);
  if (read.emergency_stop) state.emergency_stop = *read.emergency_stop;
  std::string ran_in;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    AxisTrack& axis = state.axes[i];
    bool told = false;
    for (std::size_t end = 0; end < kEnds; ++end) {
      if (!read.limits[i][end]) continue;
      InputTrack& line = state.limit_lines[i][end];
      line = {*read.limits[i][end], true, std::max(line.as_of, read.asked)};
      told = true;
    }
    if (!told) continue;
    axis.last.at_low_limit = axis.drive_limits[kLow];
    axis.last.at_high_limit = axis.drive_limits[kHigh];
    axis.last = with_limit_lines(state, i, axis.last);
    const bool moves = state.motion && minds_switches(*state.motion) && state.motion->involved[i];
    if (moves && ran_in.empty()) ran_in = ran_into_switch(setup, state, i, axis.last);
  }
  if (!ran_in.empty()) stop_everything(setup, state, actions, ran_in);
}

void forget_limit_lines(const Setup& setup, State& state, const std::string& device) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    for (std::size_t end = 0; end < kEnds; ++end) {
      const auto& line = setup.rig.lines.limit[i][end];
      if (line && machine::lines_name(setup.rig.lines, line->device) == device)
        state.limit_lines[i][end].known = false;
    }
  }
}

void watch_limit_lines(const Setup& setup, State& state, Actions& actions) {
  if (!state.motion || !minds_switches(*state.motion)) return;
  Motion& motion = *state.motion;
  motion.lines_at.reset();
  bool answered = true;
  Time as_of = Time::max();
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    for (std::size_t end = 0; end < kEnds && motion.involved[i]; ++end) {
      if (!setup.rig.lines.limit[i][end]) continue;
      const InputTrack& line = state.limit_lines[i][end];
      as_of = std::min(as_of, std::max(line.as_of, motion.began));
      answered = answered && line.as_of >= state.lines_asked;
    }
  }
  if (as_of == Time::max()) return;  // no axis that moves has any
  const double bound_s = setup.rig.deadlines.lines_s;
  const Time bound = as_of + seconds(bound_s);
  if (state.now >= bound) {
    stop_everything(setup, state, actions, fmt::format("the limit lines were not read for {:g} s", bound_s));
    return;
  }
  const Time next = state.lines_asked + seconds(std::min(kLookEvery_s, bound_s / kLooksPerBound));
  if (answered && state.now >= next) {
    state.lines_asked = state.now;
    actions.push_back(ReadLines{state.now, true});
    answered = false;
  }
  motion.lines_at = answered ? std::min(next, bound) : bound;
}

}  // namespace rig::daemon
