#include "daemon/queue.h"

#include <algorithm>

#include "daemon/job.h"
#include "daemon/messages.h"
#include "daemon/motion.h"

namespace rig::daemon {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

tl::unexpected<base::Error> unknown(std::uint64_t id) {
  return fail(ErrorCode::refused, fmt::format("there is no job {}", id), {}, "`rig job list` shows them");
}

bool waits_or_runs(const JobEntry& job) {
  return job.state == JobEntry::State::queued || job.state == JobEntry::State::active;
}

}  // namespace

Result<void> hold_job(State& state, Actions& actions, std::uint64_t id, const std::string& reason) {
  JobEntry* job = find_job(state, id);
  if (job == nullptr) return unknown(id);
  if (!waits_or_runs(*job)) return fail(ErrorCode::refused, fmt::format("job {} has ended", id));
  if (!job->hold.empty())
    return fail(ErrorCode::refused, fmt::format("job {} is held already: {}", id, job->hold));
  job->hold = reason.empty() ? "held by an operator" : reason;
  job->hold_told = true;
  publish_job(state, actions, *job);
  return {};
}

Result<void> release_job(State& state, Actions& actions, std::uint64_t id) {
  JobEntry* job = find_job(state, id);
  if (job == nullptr) return unknown(id);
  const bool sample_changed = job->needs_sample_change && job->state == JobEntry::State::active;
  if (!waits_or_runs(*job) || (job->hold.empty() && !sample_changed)) {
    return fail(ErrorCode::refused, fmt::format("job {} is not held", id));
  }
  job->hold.clear();
  job->hold_told = false;
  if (state.job && state.job->id == id) state.job->lamp_asked = false;
  if (sample_changed) job->needs_sample_change = false;
  publish_job(state, actions, *job);
  return {};
}

Result<void> reorder_job(State& state, Actions& actions, std::uint64_t id, std::uint64_t before) {
  if (id == before) return fail(ErrorCode::refused, "a job cannot come before itself");
  for (const std::uint64_t named : {id, before}) {
    if (named == 0 && named == before) continue;
    const JobEntry* job = find_job(state, named);
    if (job == nullptr) return unknown(named);
    if (job->state != JobEntry::State::queued)
      return fail(ErrorCode::refused, fmt::format("job {} does not wait in the queue", named));
  }
  const auto at = [&state](std::uint64_t wanted) {
    return std::find_if(state.jobs.begin(), state.jobs.end(),
                        [wanted](const JobEntry& job) { return job.id == wanted; });
  };
  JobEntry moved = std::move(*at(id));
  state.jobs.erase(at(id));
  state.jobs.insert(before == 0 ? state.jobs.end() : at(before), std::move(moved));
  std::vector<std::uint64_t> order;
  for (const JobEntry& job : state.jobs) order.push_back(job.id);
  actions.push_back(SaveOrder{std::move(order)});
  publish_job(state, actions, *find_job(state, id));
  return {};
}

void advance_parking(const Setup& setup, State& state, Actions& actions) {
  if (!state.parking) return;
  if (!state.stopped.empty() || state.ending || !setup.rig.unattended.park_rad) {
    state.parking = false;
    return;
  }
  if (state.motion) return;
  for (const AxisTrack& axis : state.axes) {
    if (!axis.known || axis.last.moving) return;  // the regular look will tell
  }
  state.parking = false;
  if (auto ok = begin_move(setup, state, actions, {true, true, true, true}, *setup.rig.unattended.park_rad,
                           std::nullopt);
      !ok) {
    publish_alarm(state, actions, "not parked: " + ok.error().text());
  }
}

}  // namespace rig::daemon
