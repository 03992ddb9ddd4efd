#include "daemon/reference_visit.h"

#include <utility>

#include "daemon/job.h"
#include "daemon/messages.h"
#include "daemon/visit.h"

namespace rig::daemon {

using base::seconds;
using Outcome = VisitOutcome::Kind;

namespace {

scan::Retake retake_after(Outcome outcome) {
  switch (outcome) {
    case Outcome::good:
    case Outcome::unproven:
      return scan::Retake::none;
    case Outcome::bad:
      return scan::Retake::since_good;
    case Outcome::replaces:
      return scan::Retake::all;
  }
  return scan::Retake::none;
}

void record(State& state, Actions& actions, scan::VisitRecord visit, VisitOutcome outcome) {
  ActiveJob& job = *state.job;
  visit.number = job.visits.next;
  visit.when = state.now;
  visit.good = outcome.kind == Outcome::good || outcome.kind == Outcome::replaces;
  visit.what = outcome.verdict.what;
  const scan::Retake retake = retake_after(outcome.kind);
  job.visit.reset();
  job.recording = std::move(outcome);
  actions.push_back(RecordVisit{std::move(visit), retake});
}

// How many visits agreed with the standard; 0 where no pose relies on it that a later visit has proven.
int agreed_with_standard(const ActiveJob& job, const JobEntry& entry) {
  const bool relied_on = entry.done > job.visits.poses_since_good;
  // One was there before, or it would not be the standard.
  return relied_on && job.visits.agreed > 0 ? job.visits.agreed + 1 : 0;
}

void tell_visit(State& state, Actions& actions, const VisitRecorded& recorded, const VisitVerdict& verdict) {
  protocol::Event event;
  auto& visited = *event.mutable_reference_visited();
  visited.set_job(state.job->id);
  visited.set_visit(recorded.visit.number);
  visited.set_good(recorded.visit.good);
  visited.set_what(recorded.visit.what);
  visited.set_dark_dn(verdict.dark_dn);
  visited.set_level(verdict.level);
  visited.set_unevenness(verdict.unevenness);
  visited.set_flat_level(verdict.flat_level);
  visited.set_flat_unevenness(verdict.flat_unevenness);
  visited.set_poses_again(static_cast<std::uint32_t>(recorded.again.size()));
  publish(state, actions, std::move(event));
}

// `anew`: no pose relies on the standard so far.
void take_good(ActiveJob& job, const scan::VisitRecord& visit, Time now, bool anew) {
  job.bad_visits = 0;
  job.visits.poses_since_good = 0;
  job.visits.last_good = now;  // the journal's may be later, where the clock was set back
  if (anew) {
    job.visits.first = visit;
    job.visits.agreed = 0;
  }
  ++job.visits.agreed;
}

void take_bad(State& state, Actions& actions, const machine::ReferenceConfig& config,
              const VisitVerdict& verdict) {
  ActiveJob& job = *state.job;
  job.visits.poses_since_good = 0;
  job.reference_due = true;
  if (++job.bad_visits >= config.attempts) {
    job.bad_visits = 0;
    hold_for_person(state, actions, verdict.what);
    return;
  }
  job.bad_visit = BadVisit{verdict.room_dark, verdict.what, state.now + seconds(config.again_s)};
}

}  // namespace

void resume_reference_visits(const Setup& setup, State& state, const scan::VisitsSoFar& so_far) {
  ActiveJob& job = *state.job;
  job.visits = so_far;
  if (const auto& reference = setup.rig.unattended.reference)
    job.rival = rival_of(*reference, so_far, agreed_with_standard(job, *find_job(state, job.id)));
}

void judge_reference_visit(const Setup& setup, State& state, Actions& actions) {
  ActiveJob& job = *state.job;
  scan::VisitRecord now;
  now.when = state.now;
  now.looks = job.visit->looks;
  VisitOutcome outcome =
      weigh_visit(*setup.rig.unattended.reference, job.visits.first,
                  agreed_with_standard(job, *find_job(state, job.id)), job.rival, now, job.bad_visits > 0);
  record(state, actions, std::move(now), std::move(outcome));
}

void record_failed_visit(State& state, Actions& actions, const std::string& reason) {
  VisitOutcome failed;
  failed.verdict.what = reason;
  state.job->rival.reset();
  record(state, actions, {}, std::move(failed));
}

void on_visit_recorded(const Setup& setup, State& state, Actions& actions, const VisitRecorded& recorded) {
  if (!state.job || !state.job->recording || state.job->visits.next != recorded.visit.number) return;
  ActiveJob& job = *state.job;
  const VisitOutcome outcome = *std::exchange(job.recording, std::nullopt);
  job.reference_due = false;
  job.visits.next = recorded.visit.number + 1;
  JobEntry& entry = *find_job(state, job.id);
  if (!recorded.again.empty()) {
    job.rows.assign(recorded.pending.begin(), recorded.pending.end());
    entry.done = recorded.progress.done;
  }
  tell_visit(state, actions, recorded, outcome.verdict);
  switch (outcome.kind) {
    case Outcome::good:
      return take_good(job, recorded.visit, state.now, !job.visits.first || entry.done == 0);
    case Outcome::replaces:
      return take_good(job, recorded.visit, state.now, true);
    case Outcome::unproven:
      job.reference_due = true;  // at once
      return;
    case Outcome::bad:
      return take_bad(state, actions, *setup.rig.unattended.reference, outcome.verdict);
  }
}

}  // namespace rig::daemon
