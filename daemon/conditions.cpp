#include "daemon/conditions.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/job.h"
#include "daemon/messages.h"
#include "daemon/safety.h"
#include "daemon/space.h"

namespace rig::daemon {

using base::seconds;

namespace {

// What a signal says. Between the two thresholds it says neither: that is its hysteresis.
struct Signal {
  bool enter = false;
  bool leave = false;
  std::string reason;  // where `enter`
};

enum class Way {
  latch,       // the stop is latched
  nothing,     // what has to be done is done already
  at_once,     // the pose in flight is given back
  after_pose,  // the pose in flight is finished
};

struct Rule {
  Condition condition;
  std::string_view name;
  Signal (*signal)(const Setup&, const State&, const JobEntry&);
  double enter_s;                           // so long it must be there
  double leave_s;                           // so long it must be gone
  double machine::SuspendConfig::*limit_s;  // how long at most
  Way way;
  base::WaitFor waits;
};

constexpr double kCooler_c = 5;           // below the limit, before it is released
constexpr double kMarginMore = 0.25;      // of the disk's margin, before it is released
constexpr double kWarmUpPatience_s = 60;  // beyond twice the lamp's warm-up

Signal emergency_stop_signal(const Setup& /*setup*/, const State& state, const JobEntry& /*job*/) {
  return {state.emergency_stop, !state.emergency_stop, "emergency stop"};
}

Signal stopped_signal(const Setup& /*setup*/, const State& state, const JobEntry& /*job*/) {
  return {!state.stopped.empty(), state.stopped.empty(), state.stopped};
}

Signal device_lost_signal(const Setup& /*setup*/, const State& state, const JobEntry& /*job*/) {
  Signal signal{!state.lost.empty(), state.lost.empty(), {}};
  for (const auto& [device, what] : state.lost) signal.reason += (signal.reason.empty() ? "" : "; ") + what;
  return signal;
}

Signal light_signal(const Setup& setup, const State& state, const JobEntry& /*job*/) {
  if (!state.job) return {};
  const drivers::LightState& light = state.light;
  const double band = setup.rig.unattended.suspend.light_band;
  const double off = std::abs(light.level - 1);
  Signal signal;
  signal.leave = light.on && light.warm && (!setup.light.has_level || off <= 0.5 * band);
  // A visit shuts the shutter itself, and judges the light by its frames.
  if (state.job->phase == ActiveJob::Phase::running && !state.job->visit && !state.job->recording) {
    signal.enter = true;
    if (!light.on) {
      signal.reason = "the light went out";
    } else if (!light.warm) {
      signal.reason = "the light is not warm";
    } else if (setup.light.has_shutter && !light.shutter_open) {
      signal.reason = "the light's shutter is shut";
    } else if (setup.light.has_level && !(off <= band)) {
      signal.reason = fmt::format("the light is at level {:.3f}, farther than {} from 1", light.level, band);
    } else {
      signal.enter = false;
    }
  } else if (state.job->phase == ActiveJob::Phase::warming) {
    const double patience_s = 2 * setup.light.warm_up_s + setup.rig.light.cool_down_s + kWarmUpPatience_s;
    if (state.now - state.job->warming_since >= seconds(patience_s)) {
      signal.enter = !light.warm;
      signal.reason = fmt::format("the light did not get warm in {:.0f} s", patience_s);
    }
  }
  return signal;
}

Signal disk_signal(const Setup& setup, const State& state, const JobEntry& /*job*/) {
  if (state.disk_refuses) return {true, false, *state.disk_refuses};
  if (!state.job || !state.free_bytes) return {};  // what it was stays until it is read
  const double margin = setup.rig.unattended.suspend.disk_margin_bytes;
  const double need = bytes_left_to_write(setup, state);
  const double free = *state.free_bytes;
  return {free < need + margin, free >= need + (1 + kMarginMore) * margin,
          fmt::format("the scan's disk has {:.1f} MB free; the rest of the job needs {:.1f} MB and {:.1f} MB "
                      "of margin",
                      free * 1e-6, need * 1e-6, margin * 1e-6)};
}

Signal temperature_signal(const Setup& setup, const State& state, const JobEntry& /*job*/) {
  const auto limit = setup.rig.unattended.suspend.max_temperature_c;
  if (!limit) return {false, true, {}};
  std::optional<double> hottest;
  std::string device;
  const auto look = [&](const std::optional<double>& temperature_c, const std::string& name) {
    if (!temperature_c || (hottest && *temperature_c <= *hottest)) return;
    hottest = temperature_c;
    device = name;
  };
  look(state.light.temperature_c, "the light");
  look(state.camera_temperature_c, "the camera");
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    look(state.axes[i].last.temperature_c, fmt::format("axis {}", machine::kAxisNames[i]));
  }
  if (!hottest) return {false, true, {}};
  return {*hottest > *limit, *hottest < *limit - kCooler_c,
          fmt::format("{} has {:.1f} degrees C, more than {:.1f}", device, *hottest, *limit)};
}

Signal held_signal(const Setup& /*setup*/, const State& /*state*/, const JobEntry& job) {
  return {!job.hold.empty(), job.hold.empty(), job.hold};
}

Signal sample_change_signal(const Setup& /*setup*/, const State& /*state*/, const JobEntry& job) {
  return {job.needs_sample_change, !job.needs_sample_change,
          fmt::format("put the sample '{}' on the carrier, then release the job", job.sample)};
}

Signal bad_visit_signal(const State& state, bool room_dark) {
  if (!state.job) return {};
  const auto& bad = state.job->bad_visit;
  const bool on = bad && bad->room_dark == room_dark;
  return {on, !on, on ? bad->what : std::string()};
}

Signal reference_signal(const Setup& /*setup*/, const State& state, const JobEntry& /*job*/) {
  return bad_visit_signal(state, true);
}

Signal room_signal(const Setup& /*setup*/, const State& state, const JobEntry& /*job*/) {
  return bad_visit_signal(state, false);
}

using base::WaitFor;
// A stop stays until a person clears it: that is its hysteresis.
constexpr auto kLimit = &machine::SuspendConfig::limit_s;
constexpr auto kPersonLimit = &machine::SuspendConfig::person_limit_s;
constexpr std::array<Rule, kConditionCount> kRules{{
    // condition, name, signal, enter_s, leave_s, limit, way, waits
    {Condition::emergency_stop, "emergency stop", emergency_stop_signal, 0, 0, kPersonLimit, Way::latch,
     WaitFor::person},
    {Condition::stopped, "stopped", stopped_signal, 0, 0, kPersonLimit, Way::nothing, WaitFor::person},
    {Condition::device_lost, "device lost", device_lost_signal, 0, 1, kLimit, Way::at_once, WaitFor::rig},
    {Condition::light, "light", light_signal, 0, 1, kLimit, Way::at_once, WaitFor::rig},
    {Condition::disk, "disk", disk_signal, 0, 0, kLimit, Way::after_pose, WaitFor::person},
    {Condition::temperature, "temperature", temperature_signal, 2, 10, kLimit, Way::after_pose, WaitFor::rig},
    {Condition::held, "held", held_signal, 0, 0, kPersonLimit, Way::after_pose, WaitFor::person},
    {Condition::sample_change, "sample change", sample_change_signal, 0, 0, kPersonLimit, Way::after_pose,
     WaitFor::person},
    {Condition::reference, "reference", reference_signal, 0, 0, kLimit, Way::at_once, WaitFor::rig},
    {Condition::room_not_dark, "room not dark", room_signal, 0, 0, kLimit, Way::at_once, WaitFor::rig},
}};

const Rule& rule_of(Condition condition) {
  return *std::find_if(kRules.begin(), kRules.end(),
                       [condition](const Rule& rule) { return rule.condition == condition; });
}

ConditionTrack& track_of(State& state, Condition condition) {
  return state.conditions[static_cast<std::size_t>(condition)];
}

bool any_on(const State& state) {
  return std::any_of(state.conditions.begin(), state.conditions.end(),
                     [](const ConditionTrack& track) { return track.on; });
}

void enter(const Setup& setup, State& state, Actions& actions, const Rule& rule, std::uint64_t job,
           const std::string& reason) {
  const double limit_s = setup.rig.unattended.suspend.*rule.limit_s;
  track_of(state, rule.condition) = ConditionTrack{true, state.now, std::nullopt, reason, false, limit_s};
  if (state.job) {
    state.job->suspended = true;
    if (rule.way == Way::at_once) give_back(state, actions);
  }
  protocol::Event event;
  auto& suspended = *event.mutable_job_suspended();
  suspended.set_job(job);
  suspended.set_condition(std::string(rule.name));
  suspended.set_reason(reason);
  suspended.set_limit_s(limit_s);
  publish(state, actions, std::move(event));
}

void leave(State& state, Actions& actions, const Rule& rule, std::uint64_t job) {
  ConditionTrack& track = track_of(state, rule.condition);
  protocol::Event event;
  auto& released = *event.mutable_job_released();
  released.set_job(job);
  released.set_condition(std::string(rule.name));
  released.set_suspended_s(base::to_seconds(state.now - track.since));
  track = ConditionTrack{};
  released.set_goes_on(!any_on(state));
  publish(state, actions, std::move(event));
}

void pass_limit(const Setup& setup, State& state, Actions& actions, const Rule& rule, std::uint64_t job) {
  ConditionTrack& track = track_of(state, rule.condition);
  track.limit_passed = true;
  const std::string reason = fmt::format("suspended for more than {:.0f} s: {}", track.limit_s, track.reason);
  // Behind a stop the next job could not begin either.
  if (setup.rig.unattended.suspend.fail_at_limit && rule.condition != Condition::stopped) {
    end_job(setup, state, actions, job, JobEntry::State::failed, reason);
    return;
  }
  JobEntry* entry = find_job(state, job);
  // An operator's own hold stays as it is.
  if (!entry->hold.empty()) return;
  entry->hold = reason;
  entry->hold_told = true;
}

}  // namespace

void watch_conditions(const Setup& setup, State& state, Actions& actions) {
  // A stop is latched whether a job runs or not.
  if (const Signal stop = emergency_stop_signal(setup, state, {}); stop.enter && state.stopped.empty()) {
    stop_everything(setup, state, actions, stop.reason);
  }
  const JobEntry* active = active_job(state);
  if (active == nullptr || state.ending) {
    state.conditions = {};
    return;
  }
  const std::uint64_t job = active->id;
  bool changed = false;
  std::string tell;
  for (const Rule& rule : kRules) {
    active = active_job(state);
    if (active == nullptr || active->id != job) return;  // a limit ended it
    if (rule.way == Way::latch) continue;
    ConditionTrack& track = track_of(state, rule.condition);
    const Signal signal = rule.signal(setup, state, *active);
    if (track.on ? signal.leave : signal.enter) {
      if (!track.turning) track.turning = state.now;
      if (state.now - *track.turning >= seconds(track.on ? rule.leave_s : rule.enter_s)) {
        if (track.on) {
          leave(state, actions, rule, job);
        } else {
          enter(setup, state, actions, rule, job, signal.reason);
          if (rule.condition != Condition::held) {
            tell = "suspended";
          } else if (!active->hold_told) {
            tell = "held";  // by a visit
          }
        }
        changed = true;
      }
    } else {
      track.turning.reset();
    }
    if (track.on && !track.limit_passed && state.now - track.since >= seconds(track.limit_s)) {
      pass_limit(setup, state, actions, rule, job);
      tell = "held";
      changed = true;
    }
  }
  if (state.job) {
    state.job->suspended = any_on(state);
    if (!state.job->suspended) state.job->resting = false;
  }
  active = active_job(state);
  if (!changed || active == nullptr || active->id != job) return;  // the last rule's limit may have ended it
  publish_job(state, actions, *active);
  if (!tell.empty()) actions.push_back(TellOfJob{make_job_info(state, *active), tell, false});
}

std::string_view condition_name(Condition condition) {
  return rule_of(condition).name;
}

std::vector<ActiveCondition> active_conditions(const State& state) {
  std::vector<ActiveCondition> on;
  for (const Rule& rule : kRules) {
    const ConditionTrack& track = state.conditions[static_cast<std::size_t>(rule.condition)];
    if (track.on) on.push_back({rule.condition, &track});
  }
  return on;
}

bool waits_for_rig(const State& state) {
  const auto on = active_conditions(state);
  return !on.empty() && std::all_of(on.begin(), on.end(), [](const ActiveCondition& active) {
    return rule_of(active.condition).waits == WaitFor::rig;
  });
}

const JobEntry* active_job(const State& state) {
  for (const JobEntry& job : state.jobs) {
    if (state.job ? job.id == state.job->id : job.state == JobEntry::State::active) return &job;
  }
  return nullptr;
}

}  // namespace rig::daemon
