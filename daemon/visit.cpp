#include "daemon/visit.h"

#include <algorithm>

#include "core/machine/reference_looks.h"
#include "daemon/exposing.h"
#include "daemon/job.h"
#include "daemon/messages.h"
#include "daemon/motion.h"
#include "daemon/place.h"
#include "daemon/reference_visit.h"

namespace rig::daemon {

using base::seconds;
using Kind = Visit::Kind;
using Stage = Visit::Stage;
using machine::Look;

namespace {

constexpr int kAttempts = 3;
constexpr double kAgain_s = 2;

std::vector<Look> looks_of(const Setup& setup, const ActiveJob& job, Kind kind) {
  if (kind == Kind::place) return {{"place", job.place->target_rad, job.place->exposure_s, true}};
  if (kind == Kind::identity) return {machine::identity_look(setup.rig)};
  return machine::reference_looks(setup.rig, setup.light.has_shutter);
}

// What was due is not any more.
void settle(ActiveJob& job, Kind kind) {
  job.visit.reset();
  if (kind == Kind::place) job.place.reset();
  if (kind == Kind::identity) job.identity_due = false;
  if (kind == Kind::reference) job.reference_due = false;
}

bool reference_is_due(const Setup& setup, const State& state) {
  const auto& config = setup.rig.unattended.reference;
  const ActiveJob& job = *state.job;
  if (!config) return false;
  // Work that nothing has proven yet.
  const bool unproven = job.visits.poses_since_good > 0;
  if (job.rows.empty()) return unproven && !job.last_visit_skipped;
  if (job.committed < job.visit_after) return false;
  if (job.reference_due) return true;
  const std::int64_t taken = job.visits.poses_since_good + (job.current ? 1 : 0) + (job.storing ? 1 : 0);
  if (config->every_poses > 0 && taken >= config->every_poses) return true;
  return config->every_s > 0 && unproven && state.now - job.visits.last_good >= seconds(config->every_s);
}

std::optional<Kind> due(const Setup& setup, const State& state) {
  const ActiveJob& job = *state.job;
  if (job.place && !job.rows.empty()) return Kind::place;
  if (job.identity_due && !job.rows.empty()) return Kind::identity;
  if (reference_is_due(setup, state)) return Kind::reference;
  return std::nullopt;
}

// From where the rig stands, and on to the next pose.
std::string why_unreachable_now(const Setup& setup, const State& state, const std::vector<Look>& looks) {
  JointAngles here{};
  for (std::size_t i = 0; i < kAxisCount; ++i) here[i] = state.axes[i].last.position_rad;
  const auto& rows = state.job->rows;
  return machine::why_unreachable(setup.rig, here, looks, rows.empty() ? nullptr : &rows.front().target_rad);
}

void put_off(State& state, Actions& actions, Kind kind, const std::string& why) {
  ActiveJob& job = *state.job;
  switch (kind) {
    case Kind::place:
      publish_alarm(state, actions,
                    "the job goes on without a check whether the sample or the rig moved: " + why);
      job.place.reset();
      return;
    case Kind::identity:
      hold_for_person(state, actions, "it cannot be checked which sample is on the carrier: " + why);
      job.identity_due = false;
      return;
    case Kind::reference:
      if (!job.rows.empty()) {
        job.visit_after = job.committed + 1;
        return;
      }
      publish_alarm(state, actions, "the last poses are not proven by a reference visit: " + why);
      job.last_visit_skipped = true;
      return;
  }
}

void fail_look(State& state, Actions& actions, const std::string& reason) {
  ActiveJob& job = *state.job;
  Visit& visit = *job.visit;
  if (++visit.attempts < kAttempts) {
    visit.stage = Stage::to_move;
    job.not_before = state.now + seconds(kAgain_s);
    return;
  }
  const Kind kind = visit.kind;
  if (kind == Kind::reference) {
    record_failed_visit(state, actions, "the reference could not be looked at: " + reason);
    return;
  }
  settle(job, kind);
  hold_for_person(state, actions,
                  kind == Kind::place ? "it cannot be checked whether the sample or the rig moved: " + reason
                                      : "it cannot be checked which sample is on the carrier: " + reason);
}

// Whether every axis stands, and where is known.
bool stands(const State& state) {
  return std::all_of(state.axes.begin(), state.axes.end(),
                     [](const AxisTrack& axis) { return axis.known && !axis.last.moving; });
}

void begin(const Setup& setup, State& state, Actions& actions, Kind kind) {
  if (!stands(state)) return;  // the regular look will tell
  if (!all_homed(state)) {
    state.job->phase = ActiveJob::Phase::homing;
    return;
  }
  const std::string why = why_unreachable_now(setup, state, looks_of(setup, *state.job, kind));
  if (!why.empty()) return put_off(state, actions, kind, why);
  state.job->visit = Visit{};
  state.job->visit->kind = kind;
}

void go_there(const Setup& setup, State& state, Actions& actions, const Look& look) {
  if (!stands(state)) return;
  state.job->visit->stage = Stage::moving;
  if (auto ok = begin_move(setup, state, actions, {true, true, true, true}, look.pose_rad, std::nullopt); !ok)
    fail_look(state, actions, ok.error().text());
}

void set_light(const Setup& setup, State& state, Actions& actions, const Look& look) {
  Visit& visit = *state.job->visit;
  if (setup.light.has_shutter) actions.push_back(SetShutter{look.lit});
  visit.light_asked = ++state.last_poll;
  actions.push_back(PollLight{state.last_poll});
  visit.stage = Stage::lighting;
}

void judge_place(State& state, Actions& actions, const LookFinding& finding) {
  ActiveJob& job = *state.job;
  const std::int64_t row = job.place->row;
  settle(job, Kind::place);
  protocol::Event event;
  auto& checked = *event.mutable_place_checked();
  checked.set_job(job.id);
  checked.set_row(row);
  for (const int tag : finding.tags) checked.add_tags(static_cast<std::uint32_t>(tag));
  checked.set_problem(finding.moved);
  publish(state, actions, std::move(event));
  if (finding.moved.empty()) return;
  hold_for_person(
      state, actions,
      fmt::format("the sample or the rig moved since row {} was taken: {}; release the job if that is right, "
                  "or abort it",
                  row, finding.moved));
}

void judge_identity(State& state, Actions& actions, const LookFinding& finding) {
  ActiveJob& job = *state.job;
  settle(job, Kind::identity);
  std::vector<int> missing;
  for (const int tag : job.config->sample_fiducials) {
    if (std::find(finding.tags.begin(), finding.tags.end(), tag) == finding.tags.end())
      missing.push_back(tag);
  }
  protocol::Event event;
  auto& checked = *event.mutable_place_checked();
  checked.set_job(job.id);
  checked.set_row(-1);
  for (const int tag : finding.tags) checked.add_tags(static_cast<std::uint32_t>(tag));
  if (!missing.empty()) {
    checked.set_problem(fmt::format("the sample '{}' is not on the carrier: its fiducials {} are not seen",
                                    job.config->sample, fmt::join(missing, ", ")));
  }
  const std::string problem = checked.problem();
  publish(state, actions, std::move(event));
  if (!problem.empty()) hold_for_person(state, actions, problem + "; put it there, then release the job");
}

}  // namespace

void hold_for_person(State& state, Actions& actions, const std::string& reason) {
  JobEntry& entry = *find_job(state, state.job->id);
  if (entry.hold.empty()) entry.hold = reason;
  publish_job(state, actions, entry);
}

void plan_visits(const Setup& setup, State& state, Actions& actions, const JobOpened& opened) {
  ActiveJob& job = *state.job;
  resume_reference_visits(setup, state, opened.visits);
  job.place = opened.place;
  job.reference_due = setup.rig.unattended.reference.has_value();
  job.identity_due = !opened.config->sample_fiducials.empty() && opened.progress.done == 0;
  if (!opened.not_checked.empty()) {
    publish_alarm(
        state, actions,
        "the job goes on without a check whether the sample or the rig moved: " + opened.not_checked);
  }
}

bool visit_comes_first(const Setup& setup, const State& state) {
  return state.job->visit || state.job->recording || due(setup, state);
}

void advance_visit(const Setup& setup, State& state, Actions& actions) {
  ActiveJob& job = *state.job;
  if (state.motion || state.frame || state.snap || job.recording || state.now < job.not_before) return;
  if (!job.visit) {
    const auto kind = due(setup, state);
    if (kind) begin(setup, state, actions, *kind);
    if (!job.visit) return;
  }
  Visit& visit = *job.visit;
  const auto looks = looks_of(setup, job, visit.kind);
  const Look& look = looks[visit.look];
  if (visit.stage == Stage::to_move) go_there(setup, state, actions, look);
  if (!job.visit) return;
  if (visit.stage == Stage::to_light) set_light(setup, state, actions, look);
  if (visit.stage == Stage::lighting) {
    const bool as_asked = !setup.light.has_shutter || state.light.shutter_open == look.lit;
    if (state.light_read >= visit.light_asked && as_asked) visit.stage = Stage::to_expose;
  }
  if (visit.stage == Stage::to_expose) {
    actions.push_back(ArmCamera{});
    trigger_camera(setup, state, actions, look.exposure_s, kVisitRow, static_cast<int>(visit.look));
    visit.exposure = state.frame->exposure;
    visit.stage = Stage::exposing;
  }
}

void on_visit_motion_end(const Setup& /*setup*/, State& state, Actions& actions, const MotionEnd& end) {
  Visit& visit = *state.job->visit;
  if (visit.stage != Stage::moving) return;
  if (!end.failure.empty()) return fail_look(state, actions, end.failure);
  visit.stage = Stage::to_light;
}

void on_visit_frame(const Setup& setup, State& state, Actions& actions, const FrameFetched& fetched) {
  if (!state.job || !state.job->visit || state.job->visit->stage != Stage::exposing) {
    actions.push_back(ReleaseFrame{fetched.slot});
    return;
  }
  ActiveJob& job = *state.job;
  Visit& visit = *job.visit;
  const auto looks = looks_of(setup, job, visit.kind);
  JudgeLook judge{fetched.slot,
                  visit.exposure,
                  visit.kind,
                  job.visits.next,
                  looks[visit.look].name,
                  fetched.info,
                  looks[visit.look].pose_rad,
                  {},
                  job.place};
  for (std::size_t i = 0; i < kAxisCount; ++i) judge.readback_rad[i] = state.axes[i].last.position_rad;
  actions.push_back(std::move(judge));
  visit.stage = Stage::judging;
}

void on_visit_frame_refused(State& state, Actions& actions, const std::string& reason) {
  if (state.job && state.job->visit && state.job->visit->stage == Stage::exposing)
    fail_look(state, actions, reason);
}

void on_look_judged(const Setup& setup, State& state, Actions& actions, const LookJudged& judged) {
  if (!state.job || !state.job->visit || state.job->visit->stage != Stage::judging ||
      state.job->visit->exposure != judged.exposure) {
    return;  // of a visit that was stopped
  }
  ActiveJob& job = *state.job;
  Visit& visit = *job.visit;
  if (!judged.finding) return fail_look(state, actions, judged.finding.error().text());
  if (visit.kind == Kind::place) return judge_place(state, actions, *judged.finding);
  if (visit.kind == Kind::identity) return judge_identity(state, actions, *judged.finding);
  visit.looks.push_back(judged.finding->record);
  const auto looks = looks_of(setup, job, visit.kind);
  if (++visit.look < looks.size()) {
    const bool stays = looks[visit.look].pose_rad == looks[visit.look - 1].pose_rad;
    visit.stage = stays ? Stage::to_light : Stage::to_move;
    return;
  }
  judge_reference_visit(setup, state, actions);
}

void end_pause_after_bad_visit(State& state) {
  if (state.job && state.job->bad_visit && state.now >= state.job->bad_visit->again)
    state.job->bad_visit.reset();
}

}  // namespace rig::daemon
