#include "daemon/messages.h"

#include <algorithm>

#include "core/base/units.h"
#include "daemon/conditions.h"
#include "daemon/lease.h"
#include "daemon/space.h"

namespace rig::daemon {

using base::degrees;

namespace {

std::int64_t microseconds(Time time) {
  return std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count();
}

protocol::JobState translate(const State& state, const JobEntry& job, bool at_work) {
  if (job.state == JobEntry::State::queued && !job.hold.empty()) return protocol::HELD;
  if (at_work) {
    const auto on = active_conditions(state);
    const bool person = std::any_of(on.begin(), on.end(), [](const ActiveCondition& active) {
      return active.condition == Condition::held || active.condition == Condition::sample_change;
    });
    if (person) return protocol::HELD;
    if (!on.empty()) return protocol::SUSPENDED;
  }
  switch (job.state) {
    case JobEntry::State::queued:
      return protocol::QUEUED;
    case JobEntry::State::active:
      return protocol::ACTIVE;
    case JobEntry::State::complete:
      return protocol::COMPLETE;
    case JobEntry::State::aborted:
      return protocol::ABORTED;
    case JobEntry::State::failed:
      return protocol::JOB_FAILED;
  }
  return protocol::JOB_STATE_UNSPECIFIED;
}

// The pose in flight that an event is about.
PoseTake* take_of(State& state, const protocol::Event& event) {
  std::int64_t row = -1;
  if (event.has_pose_started()) row = event.pose_started().row();
  if (event.has_pose_arrived()) row = event.pose_arrived().row();
  if (event.has_frame_taken()) row = event.frame_taken().row();
  if (row < 0 || !state.job) return nullptr;
  for (auto* take : {&state.job->current, &state.job->storing}) {
    if (*take && (*take)->row == row) return &**take;
  }
  return nullptr;
}

// What the report tells stays with the scan.
std::uint64_t journal_of(const protocol::Event& event) {
  if (event.has_pose_failed()) return event.pose_failed().job();
  if (event.has_job_suspended()) return event.job_suspended().job();
  if (event.has_job_released()) return event.job_released().job();
  if (event.has_place_checked()) return event.place_checked().job();
  if (event.has_reference_visited()) return event.reference_visited().job();
  return 0;
}

}  // namespace

protocol::Reply make_reply(std::uint64_t id, protocol::Outcome outcome, const std::string& reason) {
  protocol::Reply reply;
  reply.set_id(id);
  reply.set_outcome(outcome);
  reply.set_reason(reason);
  return reply;
}

protocol::LightStatus make_light_status(const drivers::LightState& light) {
  protocol::LightStatus out;
  out.set_on(light.on);
  out.set_shutter_open(light.shutter_open);
  out.set_level(light.level);
  out.set_warm(light.warm);
  out.set_hours(light.hours);
  out.set_fault(light.fault);
  return out;
}

protocol::JobInfo make_job_info(const State& state, const JobEntry& job) {
  protocol::JobInfo info;
  info.set_job(job.id);
  info.set_name(job.name);
  info.set_sample(job.sample);
  const JobEntry* active = active_job(state);
  const bool at_work = active != nullptr && active->id == job.id && job.state == JobEntry::State::active;
  info.set_state(translate(state, job, at_work));
  info.set_scan_folder(job.scan_folder);
  info.set_poses(job.poses);
  info.set_done(job.done);
  info.set_abandoned(job.abandoned);
  info.set_retries(job.retries);
  info.set_reason(job.reason);
  info.set_row(-1);
  info.set_hold(job.hold);
  info.set_needs_sample_change(job.needs_sample_change);
  if (at_work) {
    for (const ActiveCondition& on : active_conditions(state)) {
      auto& suspension = *info.add_suspensions();
      suspension.set_condition(std::string(condition_name(on.condition)));
      suspension.set_reason(on.track->reason);
      suspension.set_since_us(microseconds(on.track->since));
      suspension.set_suspended_s(base::to_seconds(state.now - on.track->since));
      suspension.set_limit_s(on.track->limit_s);
    }
    info.set_resting(state.job && state.job->resting);
  }
  if (state.job && state.job->id == job.id) {
    info.set_seconds_left(state.job->seconds_per_pose *
                          static_cast<double>(job.poses - job.done - job.abandoned));
    if (state.job->current) info.set_row(state.job->current->row);
  }
  return info;
}

protocol::Mode mode_of(const State& state) {
  if (!state.stopped.empty()) return protocol::STOPPED;
  if (state.job) return protocol::RUNNING;
  if (state.snap) return protocol::EXPOSING;
  if (!state.motion) return protocol::IDLE;
  return state.motion->kind == Motion::Kind::homing ? protocol::HOMING : protocol::MOVING;
}

protocol::Status make_status(const Setup& setup, const State& state) {
  protocol::Status status;
  status.set_rig_name(setup.rig.name);
  status.set_rigd_version(setup.version);
  status.set_epoch(state.epoch);
  status.set_last_event(state.last_event);
  status.set_time_us(microseconds(state.now));
  status.set_mode(mode_of(state));
  status.set_stop_reason(state.stopped);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const AxisTrack& track = state.axes[i];
    auto& axis = *status.add_axes();
    axis.set_name(std::string(machine::kAxisNames[i]));
    axis.set_position_deg(degrees(track.last.position_rad));
    axis.set_target_deg(degrees(track.target_rad));
    axis.set_homed(track.last.homed);
    axis.set_moving(track.last.moving);
    axis.set_enabled(track.last.enabled);
    axis.set_fault(track.known ? track.last.fault : "not yet read");
    axis.set_min_deg(degrees(setup.rig.axes[i].min_rad));
    axis.set_max_deg(degrees(setup.rig.axes[i].max_rad));
    axis.set_at_low_limit(track.last.at_low_limit);
    axis.set_at_high_limit(track.last.at_high_limit);
  }
  *status.mutable_light() = make_light_status(state.light);
  for (const auto& [device, what] : state.lost) status.add_lost_devices(what);
  if (state.free_bytes) status.set_free_bytes(static_cast<std::uint64_t>(*state.free_bytes));
  status.set_bytes_left(static_cast<std::uint64_t>(bytes_left_to_write(setup, state)));
  *status.mutable_control() = make_control(setup, state);
  if (state.job) {
    for (const JobEntry& job : state.jobs) {
      if (job.id == state.job->id) *status.mutable_job() = make_job_info(state, job);
    }
  }
  return status;
}

void publish(State& state, Actions& actions, protocol::Event event) {
  event.set_epoch(state.epoch);
  event.set_number(++state.last_event);
  event.set_time_us(microseconds(state.now));
  scan::EventRecord record{state.epoch, state.last_event, state.now, event.SerializeAsString()};
  if (PoseTake* take = take_of(state, event)) {
    take->events.push_back(std::move(record));
  } else {
    actions.push_back(KeepEvent{std::move(record), journal_of(event)});
  }
  actions.push_back(Publish{std::move(event)});
}

void keep_events(const PoseTake& take, Actions& actions) {
  for (const scan::EventRecord& event : take.events) actions.push_back(KeepEvent{event, 0});
}

void publish_alarm(State& state, Actions& actions, const std::string& text) {
  protocol::Event event;
  event.mutable_alarm()->set_text(text);
  publish(state, actions, std::move(event));
}

void publish_job(State& state, Actions& actions, const JobEntry& job) {
  protocol::Event event;
  *event.mutable_job_changed()->mutable_job() = make_job_info(state, job);
  actions.push_back(SaveJob{job});
  publish(state, actions, std::move(event));
}

}  // namespace rig::daemon
