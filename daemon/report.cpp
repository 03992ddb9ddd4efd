#include "daemon/report.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>

namespace rig::daemon {

namespace {

std::int64_t microseconds(base::Time time) {
  return std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count();
}

const char* state_word(scan::RowState state) {
  switch (state) {
    case scan::RowState::pending:
      return "pending";
    case scan::RowState::done:
      return "done";
    case scan::RowState::abandoned:
      return "abandoned";
  }
  return "";
}

double median_between(std::vector<std::int64_t> commits_us) {
  if (commits_us.size() < 2) return 0;
  std::sort(commits_us.begin(), commits_us.end());
  std::vector<std::int64_t> gaps;
  for (std::size_t i = 1; i < commits_us.size(); ++i) gaps.push_back(commits_us[i] - commits_us[i - 1]);
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  return static_cast<double>(*middle) * 1e-6;
}

// In the order in which they were told.
std::vector<protocol::Event> events_of_job(const std::vector<scan::EventRecord>& records, std::uint64_t job) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, protocol::Event> sorted;
  for (const scan::EventRecord& record : records) {
    protocol::Event event;
    if (!event.ParseFromString(record.payload)) continue;  // of a newer rigd
    const bool mine = (event.has_pose_failed() && event.pose_failed().job() == job) ||
                      (event.has_job_suspended() && event.job_suspended().job() == job) ||
                      (event.has_job_released() && event.job_released().job() == job);
    if (mine) sorted[{record.epoch, record.number}] = std::move(event);
  }
  std::vector<protocol::Event> events;
  events.reserve(sorted.size());
  for (auto& [key, event] : sorted) events.push_back(std::move(event));
  return events;
}

// Every start of rigd is an epoch: those after the one in which the job began, by what it first told of it.
void add_restarts(protocol::Report& report, const std::vector<scan::EventRecord>& records,
                  std::uint64_t job) {
  std::map<std::uint64_t, std::pair<std::uint64_t, std::int64_t>> first;  // epoch -> number, time
  std::optional<std::uint64_t> began;
  for (const scan::EventRecord& record : records) {
    protocol::Event event;
    if (!event.ParseFromString(record.payload) || !event.has_job_changed()) continue;
    const protocol::JobInfo& info = event.job_changed().job();
    if (info.job() != job) continue;
    const std::pair told(record.number, event.time_us());
    const auto [entry, is_new] = first.emplace(record.epoch, told);
    if (!is_new) entry->second = std::min(entry->second, told);
    const bool at_work = info.state() == protocol::ACTIVE || info.state() == protocol::SUSPENDED;
    if (at_work) began = std::min(began.value_or(record.epoch), record.epoch);
  }
  for (const auto& [epoch, told] : first) {
    if (began && epoch > *began) report.add_restarts_us(told.second);
  }
}

void add_suspension_event(protocol::Report& report, const protocol::Event& event) {
  if (event.has_job_suspended()) {
    auto& suspension = *report.add_suspensions();
    suspension.set_condition(event.job_suspended().condition());
    suspension.set_reason(event.job_suspended().reason());
    suspension.set_since_us(event.time_us());
    return;
  }
  auto& all = *report.mutable_suspensions();
  const auto open = std::find_if(all.rbegin(), all.rend(), [&](const protocol::SuspensionReport& s) {
    return s.condition() == event.job_released().condition() && s.suspended_s() == 0;
  });
  if (open != all.rend()) open->set_suspended_s(event.job_released().suspended_s());
  report.set_suspended_s(report.suspended_s() + event.job_released().suspended_s());
}

// The drift of the light: what each visit's looks of that name show relative to those of the first good one,
// or of the one that the scan was begun anew with.
class Drift {
 public:
  explicit Drift(std::string look) : look_(std::move(look)) {}

  // 0: not known.
  double of(const scan::VisitRecord& visit) {
    const std::vector<double>* now = nullptr;
    for (const scan::LookRecord& look : visit.looks) {
      if (look.name == look_) now = &look.means_dn;
    }
    const bool begins_anew = visit.good && !visit.what.empty();
    if ((first_ == nullptr && visit.good) || begins_anew) first_ = now;
    if (first_ == nullptr || now == nullptr || now->size() != first_->size() || now->empty()) return 0;
    double sum = 0;
    for (std::size_t i = 0; i < now->size(); ++i) sum += (*now)[i] / (*first_)[i];
    return sum / static_cast<double>(now->size());
  }

 private:
  const std::string look_;
  const std::vector<double>* first_ = nullptr;
};

void add_visits(protocol::Report& report, const std::vector<scan::VisitRecord>& visits) {
  Drift patches("patches");
  Drift flat("flat");
  for (const scan::VisitRecord& visit : visits) {
    auto& told = *report.add_visits();
    told.set_visit(visit.number);
    told.set_time_us(microseconds(visit.when));
    told.set_good(visit.good);
    told.set_what(visit.what);
    told.set_level(patches.of(visit));
    told.set_flat_level(flat.of(visit));
  }
}

}  // namespace

protocol::Report make_report(const protocol::JobInfo& job, const std::vector<scan::PlanRow>& plan,
                             const std::vector<scan::PoseRecord>& poses,
                             const std::vector<scan::EventRecord>& events,
                             const std::vector<scan::VisitRecord>& visits) {
  protocol::Report report;
  *report.mutable_job() = job;
  std::map<std::int64_t, protocol::PoseReport*> by_row;
  for (const scan::PlanRow& row : plan) {
    auto& pose = *report.add_poses();
    pose.set_row(row.row);
    pose.set_state(state_word(row.state));
    pose.set_failures(static_cast<std::uint32_t>(row.attempts));
    by_row[row.row] = &pose;
  }
  for (const protocol::Event& event : events_of_job(events, job.job())) {
    if (!event.has_pose_failed()) {
      add_suspension_event(report, event);
      continue;
    }
    const auto found = by_row.find(event.pose_failed().row());
    if (found != by_row.end()) found->second->add_reasons(event.pose_failed().reason());
  }
  // The journal's own last reason, where the event is lost.
  for (const scan::PlanRow& row : plan) {
    auto& pose = *by_row[row.row];
    if (pose.reasons().empty() && !row.reason.empty()) pose.add_reasons(row.reason);
  }
  std::vector<std::int64_t> commits;
  for (const scan::PoseRecord& record : poses) {
    const auto found = by_row.find(record.row);
    if (found == by_row.end()) continue;
    found->second->set_arrived_us(microseconds(record.arrived));
    found->second->set_committed_us(microseconds(record.committed));
    found->second->set_frames(static_cast<std::uint32_t>(record.frames.size()));
    report.set_frames(report.frames() + static_cast<std::uint32_t>(record.frames.size()));
    commits.push_back(microseconds(record.committed));
    const std::int64_t arrived = microseconds(record.arrived);
    if (report.begun_us() == 0 || arrived < report.begun_us()) report.set_begun_us(arrived);
    report.set_ended_us(std::max(report.ended_us(), commits.back()));
  }
  add_restarts(report, events, job.job());
  add_visits(report, visits);
  report.set_seconds_per_pose(median_between(std::move(commits)));
  return report;
}

}  // namespace rig::daemon
