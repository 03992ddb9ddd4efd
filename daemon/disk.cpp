#include "daemon/disk.h"

#include "daemon/conditions.h"
#include "daemon/job.h"
#include "daemon/messages.h"
#include "daemon/safety.h"

namespace rig::daemon {

using base::seconds;

namespace {

constexpr double kLookEvery_s = 30;
constexpr double kShortLookEvery_s = 5;
constexpr int kTries = 5;  // that a disk may fail after it was found to take files, without a pose between

// The queue, the stop and the lease as they are: which of them the disk did not take nobody knows.
void remember_all(const State& state, Actions& actions) {
  std::vector<std::uint64_t> order;
  for (const JobEntry& job : state.jobs) {
    actions.push_back(SaveJob{job});
    order.push_back(job.id);
  }
  actions.push_back(SaveOrder{std::move(order)});
  actions.push_back(SaveStop{state.stopped});
  actions.push_back(SaveLease{state.lease.holder});
}

}  // namespace

void on_storage_failed(const Setup& setup, State& state, Actions& actions, const StorageFailed& failed) {
  if (failed.lost_scan != 0) {
    // Told for every frame that was on its way.
    const JobEntry* job = find_job(state, failed.lost_scan);
    if (job == nullptr || job->state != JobEntry::State::active) return;
    end_job(setup, state, actions, failed.lost_scan, JobEntry::State::failed, failed.what);
    return;
  }
  if (state.disk_refuses) return;  // told for everything that was on its way
  const std::string what = "the scan's disk: " + failed.what;
  if (!failed.disk_refused || ++state.disk_failures > kTries)
    return stop_everything(setup, state, actions, what);
  state.disk_refuses = what;
  state.disk_look_at = state.now + seconds(kShortLookEvery_s);
  if (active_job(state) == nullptr) publish_alarm(state, actions, what);
  if (!state.job) return;
  drop_all(setup, state, actions, what);
  discard_takes(state, actions);
  const std::uint64_t id = state.job->id;
  state.job = ActiveJob{};
  state.job->id = id;
  state.job->suspended = state.job->resting = true;
  state.free_bytes.reset();
}

void on_disk_read(State& state, Actions& actions, const DiskRead& read) {
  state.free_bytes = read.free_bytes;
  if (!state.disk_refuses || !read.takes_files) return;
  state.disk_refuses.reset();
  remember_all(state, actions);
  if (!state.job || state.job->phase != ActiveJob::Phase::opening) return;
  state.free_bytes.reset();  // of the scan it is told once that is open
  state.disk_look_at = state.now;
  actions.push_back(OpenJob{state.job->id, find_job(state, state.job->id)->scan_folder});
}

void look_at_disk(State& state, Actions& actions) {
  const bool tries = state.disk_refuses.has_value();
  if (!tries && (!state.job || state.job->phase == ActiveJob::Phase::opening)) return;
  if (state.now < state.disk_look_at) return;
  const bool is_short = tries || state.conditions[static_cast<std::size_t>(Condition::disk)].on;
  state.disk_look_at = state.now + seconds(is_short ? kShortLookEvery_s : kLookEvery_s);
  actions.push_back(PollDisk{tries});
}

}  // namespace rig::daemon
