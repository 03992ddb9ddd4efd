#include "daemon/job.h"

#include <algorithm>

#include "core/base/units.h"
#include "daemon/exposing.h"
#include "daemon/exposure_strategy.h"
#include "daemon/lamp.h"
#include "daemon/messages.h"
#include "daemon/motion.h"
#include "daemon/safety.h"
#include "daemon/visit.h"

namespace rig::daemon {

using base::seconds;

namespace {

constexpr double kSmoothing = 0.1;  // of the time a pose takes

void pick_job(State& state, Actions& actions) {
  const auto with = [&state](JobEntry::State wanted) -> JobEntry* {
    for (JobEntry& job : state.jobs) {
      const bool waits = wanted == JobEntry::State::queued && !job.hold.empty();
      if (job.state == wanted && !waits) return &job;
    }
    return nullptr;
  };
  // One that was active when rigd ended goes on before anything new begins.
  JobEntry* entry = with(JobEntry::State::active);
  if (entry == nullptr) entry = with(JobEntry::State::queued);
  if (entry == nullptr) return;
  entry->state = JobEntry::State::active;
  state.job = ActiveJob{};
  state.job->id = entry->id;
  state.free_bytes.reset();
  state.disk_look_at = state.now;
  actions.push_back(OpenJob{entry->id, entry->scan_folder});
  publish_job(state, actions, *entry);
}

void home_what_needs_it(const Setup& setup, State& state, Actions& actions) {
  std::vector<std::size_t> axes;
  for (const std::size_t i : setup.rig.home_order) {
    if (!state.axes[i].known || state.axes[i].last.moving) return;  // the regular look will tell
    if (!state.axes[i].last.homed) axes.push_back(i);
  }
  if (!limit_lines_known(setup, state)) return;
  if (!axes.empty()) {
    begin_homing(setup, state, actions, std::move(axes), std::nullopt);
    return;
  }
  state.job->phase = ActiveJob::Phase::warming;
  state.job->warming_since = state.now;
  state.job->lamp_asked = false;
  light_for_job(setup, state, actions);
  if (setup.light.has_shutter) actions.push_back(SetShutter{true});
  state.job->light_asked = ++state.last_poll;
  actions.push_back(PollLight{state.last_poll});
}

void fail_take(State& state, Actions& actions, const PoseTake& take, const std::string& reason) {
  ActiveJob& job = *state.job;
  JobEntry& entry = *find_job(state, job.id);
  const machine::RetryConfig& retry = job.config->retry;
  const bool abandon = take.attempt >= retry.attempts;
  actions.push_back(DiscardBracket{take.row});
  actions.push_back(RecordFailure{take.row, reason, abandon, take.events});
  protocol::Event event;
  auto& failed = *event.mutable_pose_failed();
  failed.set_job(job.id);
  failed.set_row(take.row);
  failed.set_attempt(static_cast<std::uint32_t>(take.attempt));
  failed.set_reason(reason);
  failed.set_abandoned(abandon);
  publish(state, actions, std::move(event));
  if (abandon) {
    ++entry.abandoned;
    return;
  }
  ++entry.retries;
  job.rows.push_front({take.row, take.target_rad, scan::RowState::pending, take.attempt, reason});
  job.not_before =
      state.now + seconds(retry.delay_s * static_cast<double>(1ULL << std::min(take.attempt - 1, 20)));
}

void fail_pose(State& state, Actions& actions, const std::string& reason) {
  const PoseTake take = *state.job->current;
  state.job->current.reset();
  fail_take(state, actions, take, reason);
}

void start_pose(const Setup& setup, State& state, Actions& actions) {
  ActiveJob& job = *state.job;
  const scan::PlanRow row = job.rows.front();
  job.rows.pop_front();
  PoseTake take;
  take.number = ++state.last_take;
  take.row = row.row;
  take.attempt = row.attempts + 1;
  take.target_rad = row.target_rad;
  job.current = take;
  protocol::Event event;
  auto& started = *event.mutable_pose_started();
  started.set_job(job.id);
  started.set_row(row.row);
  started.set_attempt(static_cast<std::uint32_t>(take.attempt));
  for (const double angle : row.target_rad) started.add_target_deg(base::degrees(angle));
  publish(state, actions, std::move(event));
  if (auto ok = begin_move(setup, state, actions, {true, true, true, true}, row.target_rad, std::nullopt);
      !ok) {
    fail_pose(state, actions, ok.error().text());
  }
}

void expose(const Setup& setup, State& state, Actions& actions, const NextExposure& next) {
  PoseTake& take = *state.job->current;
  if (take.triggered == 0) actions.push_back(ArmCamera{});
  trigger_camera(setup, state, actions, next.exposure_s, take.row, static_cast<int>(take.triggered));
  ++take.triggered;
  take.complete = next.last;
}

// The bracket needs the rig no longer: the pose waits for its files, and the rig may go on.
void hand_over(State& state) {
  state.job->storing = std::move(state.job->current);
  state.job->current.reset();
}

void advance_bracket(const Setup& setup, State& state, Actions& actions) {
  ActiveJob& job = *state.job;
  PoseTake& take = *job.current;
  if (take.arrived == Time{}) return;
  if (state.frame) {
    if (take.complete && is_exposed(state) && setup.camera.overlaps_motion && !job.storing) hand_over(state);
    return;
  }
  if (take.triggered == 0 && job.storing) return;  // the pose before is not safe on disk yet
  const NextExposure next = next_exposure(setup, job.config->exposure, take);
  switch (next.kind) {
    case NextExposure::Kind::expose:
      expose(setup, state, actions, next);
      return;
    case NextExposure::Kind::wait_for_frame:
      return;
    case NextExposure::Kind::complete:
      take.complete = true;
      if (!job.storing) hand_over(state);
      return;
  }
}

void commit_when_stored(const Setup& setup, State& state, Actions& actions) {
  PoseTake& take = *state.job->storing;
  if (take.committing || !take.complete || take.frames.size() != take.triggered) return;
  const auto stored = [](const scan::FrameRecord& f) { return !f.sha256.empty(); };
  // The light may have gone out while the last frame was exposed; conditions.cpp gives the pose back then.
  if (take.light_asked == 0) {
    take.light_asked = ++state.last_poll;
    actions.push_back(PollLight{state.last_poll});
  }
  if (state.light_read < take.light_asked) return;
  if (!std::all_of(take.frames.begin(), take.frames.end(), stored)) return;
  take.committing = true;
  take.short_share = shortfall(setup, state.job->config->exposure, take);
  actions.push_back(CommitPose{take, take.events});
}

// What an operator does meanwhile goes on.
void stop_own_work(State& state, Actions& actions) {
  if (state.motion && !state.motion->asker) stop_axes(state, actions);
  if (state.frame && state.frame->row != kSnapRow) {
    actions.push_back(AbortCamera{});
    state.frame.reset();
  }
  state.job->visit.reset();  // it is made anew
}

// Finishes what is in flight, then leaves the rig as it may stand for hours.
void rest(const Setup& setup, State& state, Actions& actions) {
  ActiveJob& job = *state.job;
  if (job.phase == ActiveJob::Phase::opening) return;
  const bool recovers = state.conditions[static_cast<std::size_t>(Condition::light)].on;
  // The last visit is made though the job is suspended. One that gave poses back does not begin them.
  const bool given_back = job.phase == ActiveJob::Phase::running && !job.rows.empty();
  if (job.resting && !given_back) {
    // While somebody holds the job he may set the light as he likes.
    if (recovers && find_job(state, job.id)->hold.empty()) light_for_job(setup, state, actions);
    return;
  }
  if (job.visit) stop_own_work(state, actions);
  if (job.current) advance_bracket(setup, state, actions);
  if (job.storing) commit_when_stored(setup, state, actions);
  if (job.current || job.storing || state.motion || state.frame) return;
  job.resting = true;
  if (job.rows.empty()) return;
  job.phase = ActiveJob::Phase::homing;  // everything is looked at again before it goes on
  job.not_before = {};
  // A lamp that is waited for has to burn.
  job.lamp_asked = false;
  if (recovers) light_for_job(setup, state, actions);
  if (setup.light.has_shutter) {
    actions.push_back(SetShutter{false});
  } else if (!recovers) {
    actions.push_back(SetLightLevel{setup.rig.light.safe_level});
  }
}

}  // namespace

JobEntry* find_job(State& state, std::uint64_t id) {
  const auto found =
      std::find_if(state.jobs.begin(), state.jobs.end(), [id](const JobEntry& j) { return j.id == id; });
  return found == state.jobs.end() ? nullptr : &*found;
}

void advance_job(const Setup& setup, State& state, Actions& actions) {
  if (!state.stopped.empty() || state.ending) return;
  if (!state.job) {
    const bool free = !state.motion && !state.snap && !state.frame && !state.parking;
    if (free && !state.disk_refuses) pick_job(state, actions);
    return;
  }
  ActiveJob& job = *state.job;
  if (job.suspended) {
    rest(setup, state, actions);
    if (job.phase != ActiveJob::Phase::running || !job.resting) return;
  }
  switch (job.phase) {
    case ActiveJob::Phase::opening:
      return;
    case ActiveJob::Phase::homing:
      if (!state.motion && !state.snap) home_what_needs_it(setup, state, actions);
      return;
    case ActiveJob::Phase::warming:
      if (!light_for_job(setup, state, actions)) return;  // it has to cool down first
      if (state.light_read < job.light_asked || !state.light.warm ||
          (setup.light.has_shutter && !state.light.shutter_open))
        return;
      job.phase = ActiveJob::Phase::running;
      job.last_commit = state.now;
      break;
    case ActiveJob::Phase::running:
      break;
  }
  if (job.current) advance_bracket(setup, state, actions);
  if (job.storing) commit_when_stored(setup, state, actions);
  if (!job.current && visit_comes_first(setup, state)) {
    if (!job.storing) advance_visit(setup, state, actions);
    // Put off, it no longer comes first.
    if (job.phase != ActiveJob::Phase::running || visit_comes_first(setup, state)) return;
  }
  if (!job.current && !job.rows.empty() && !state.motion && !state.snap && state.now >= job.not_before &&
      limit_lines_known(setup, state)) {
    if (all_homed(state)) {
      start_pose(setup, state, actions);
    } else if (!job.storing) {
      job.phase = ActiveJob::Phase::homing;  // a drive that lost its reference need not cost every pose
    }
  }
  // The last pose may have been abandoned just now, and those before it wait for a visit to prove them.
  if (!job.current && !job.storing && job.rows.empty() && !visit_comes_first(setup, state)) {
    end_job(setup, state, actions, job.id, JobEntry::State::complete, {});
  }
}

void on_job_opened(const Setup& setup, State& state, Actions& actions, const JobOpened& opened) {
  // Opened twice where a stop came between: only the first answer begins.
  if (!state.job || state.job->id != opened.id || state.job->phase != ActiveJob::Phase::opening) return;
  JobEntry* entry = find_job(state, opened.id);
  entry->done = opened.progress.done;
  entry->abandoned = opened.progress.abandoned;
  entry->poses = opened.progress.total;
  state.job->config = opened.config;
  state.job->rows.assign(opened.pending.begin(), opened.pending.end());
  state.job->phase = ActiveJob::Phase::homing;
  plan_visits(setup, state, actions, opened);
  publish_job(state, actions, *entry);
}

void on_job_motion_end(const Setup& setup, State& state, Actions& actions, const MotionEnd& end) {
  if (!state.job || end.kind == Motion::Kind::homing) return;
  if (state.job->visit) return on_visit_motion_end(setup, state, actions, end);
  if (!state.job->current) return;
  PoseTake& take = *state.job->current;
  if (!end.failure.empty()) {
    fail_pose(state, actions, end.failure);
    return;
  }
  take.arrived = state.now;
  protocol::Event event;
  auto& arrived = *event.mutable_pose_arrived();
  arrived.set_job(state.job->id);
  arrived.set_row(take.row);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    take.readback_rad[i] = state.axes[i].last.position_rad;
    arrived.add_readback_deg(base::degrees(take.readback_rad[i]));
  }
  publish(state, actions, std::move(event));
}

void on_job_frame(State& state, Actions& actions, const PendingFrame& pending, const FrameFetched& fetched) {
  ActiveJob& job = *state.job;
  PoseTake* take = nullptr;
  if (job.current && job.current->row == pending.row) take = &*job.current;
  if (job.storing && job.storing->row == pending.row) take = &*job.storing;
  if (take == nullptr) {
    actions.push_back(ReleaseFrame{fetched.slot});
    return;
  }
  scan::FrameRecord record;
  record.index = pending.index;
  record.exposure_s = fetched.info.exposure_s;
  record.gain = fetched.info.gain;
  record.saturated_share = fetched.saturated_share;
  record.started = fetched.info.started;
  take->frames.push_back(record);
  take->histograms.push_back(fetched.histogram);
  if (fetched.previews) {
    actions.push_back(PublishPreview{job.id, pending.row, pending.index, fetched.info,
                                     fetched.saturated_share, fetched.previews});
  }
  actions.push_back(StoreFrame{fetched.slot, *take, record});
  protocol::Event event;
  auto& taken = *event.mutable_frame_taken();
  taken.set_job(job.id);
  taken.set_row(pending.row);
  taken.set_index(static_cast<std::uint32_t>(pending.index));
  taken.set_exposure_us(fetched.info.exposure_s * 1e6);
  taken.set_saturated_share(fetched.saturated_share);
  publish(state, actions, std::move(event));
}

void on_job_frame_refused(State& state, Actions& actions, const PendingFrame& pending,
                          const std::string& reason) {
  for (auto* held : {&state.job->current, &state.job->storing}) {
    if (!*held || (*held)->row != pending.row) continue;
    const PoseTake take = **held;
    held->reset();
    fail_take(state, actions, take, reason);
    return;
  }
}

void on_frame_stored(State& state, const FrameStored& stored) {
  if (!state.job) return;
  for (auto* take : {&state.job->current, &state.job->storing}) {
    if (!*take || (*take)->row != stored.row || (*take)->number != stored.take) continue;
    for (scan::FrameRecord& frame : (*take)->frames) {
      if (frame.index == stored.index) frame.sha256 = stored.sha256;
    }
  }
}

void on_pose_committed(const Setup& /*setup*/, State& state, Actions& actions,
                       const PoseCommitted& committed) {
  if (!state.job || !state.job->storing || state.job->storing->row != committed.row) return;
  ActiveJob& job = *state.job;
  JobEntry& entry = *find_job(state, job.id);
  const auto frames = job.storing->frames.size();
  const auto short_share = job.storing->short_share;
  job.storing.reset();
  ++entry.done;
  ++job.committed;
  state.disk_failures = 0;
  ++job.visits.poses_since_good;
  const double took = base::to_seconds(state.now - job.last_commit);
  job.seconds_per_pose += (job.seconds_per_pose == 0 ? 1 : kSmoothing) * (took - job.seconds_per_pose);
  job.last_commit = state.now;
  protocol::Event event;
  auto& done = *event.mutable_pose_committed();
  done.set_job(job.id);
  done.set_row(committed.row);
  done.set_frames(static_cast<std::uint32_t>(frames));
  done.set_done(entry.done);
  done.set_poses(entry.poses);
  if (short_share) done.set_short_share(*short_share);
  publish(state, actions, std::move(event));
}

void discard_takes(State& state, Actions& actions) {
  for (const auto& take : {state.job->current, state.job->storing}) {
    if (!take || take->committing) continue;
    actions.push_back(DiscardBracket{take->row});
    keep_events(*take, actions);
  }
}

void give_back(State& state, Actions& actions) {
  ActiveJob& job = *state.job;
  stop_own_work(state, actions);
  for (auto* take : {&job.current, &job.storing}) {
    if (!*take) continue;
    const PoseTake& given = **take;
    if (given.committing) continue;
    actions.push_back(DiscardBracket{given.row});
    keep_events(given, actions);
    job.rows.push_front({given.row, given.target_rad, scan::RowState::pending, given.attempt - 1, {}});
    take->reset();
  }
}

TellOfJob report_of_ended(const State& state, const JobEntry& job) {
  const std::string_view occasion = job.state == JobEntry::State::complete  ? "complete"
                                    : job.state == JobEntry::State::aborted ? "aborted"
                                                                            : "failed";
  return {make_job_info(state, job), std::string(occasion), true};
}

void end_job(const Setup& setup, State& state, Actions& actions, std::uint64_t id, JobEntry::State how,
             const std::string& reason) {
  JobEntry* entry = find_job(state, id);
  if (entry == nullptr) return;
  entry->state = how;
  entry->reason = reason;
  if (state.job && state.job->id == id) {
    discard_takes(state, actions);
    stop_own_work(state, actions);
    if (setup.light.has_shutter) actions.push_back(SetShutter{false});
    state.job.reset();
    state.parking = how == JobEntry::State::aborted && setup.rig.unattended.park_rad.has_value();
  }
  const TellOfJob tell = report_of_ended(state, *entry);
  // Where rigd dies between the two, the next one finds the job complete once more. Another job must not be
  // found active again: the next rigd finds that its report is due.
  const bool first = how == JobEntry::State::complete;
  if (first) actions.push_back(tell);
  publish_job(state, actions, *entry);
  if (!first) actions.push_back(tell);
}

}  // namespace rig::daemon
