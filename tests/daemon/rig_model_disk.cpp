// The storage: plans, poses and visits.
#include <algorithm>

#include "daemon/place.h"
#include "tests/daemon/rig_model.h"

namespace rig::daemon::testing {

// Mostly of the kind that room mends.
StorageFailed RigModel::no_room(const std::string& what) {
  return {what, 0, disk_refuses || chance(0.8)};
}

void RigModel::to_disk(const Action& action) {
  if (const auto* poll = std::get_if<PollDisk>(&action)) {
    return answer(DiskRead{free_bytes, poll->write && !disk_refuses && !chance(faults.disk)});
  }
  if (const auto* create = std::get_if<CreateJob>(&action)) {
    if (chance(faults.disk)) {
      return answer(JobCreated{create->asker, base::fail(base::ErrorCode::io, "the disk is full")});
    }
    const auto config = machine::parse_job_config(create->submit.job_toml(), "job.toml");
    JobEntry entry;
    entry.id = scans_.empty() ? 1 : scans_.rbegin()->first + 1;
    Scan scan{*config, {}};
    for (std::size_t i = 0; i < config->poses.size(); ++i) {
      scan.rows.push_back({static_cast<std::int64_t>(i), config->poses[i], scan::RowState::pending, 0, {}});
    }
    entry.poses = static_cast<std::int64_t>(scan.rows.size());
    entry.needs_sample_change = config->needs_sample_change;
    scans_[entry.id] = std::move(scan);
    return answer(JobCreated{create->asker, entry});
  }
  if (const auto* open = std::get_if<OpenJob>(&action)) {
    if (disk_refuses || chance(faults.disk)) return answer(no_room("the journal cannot be opened"));
    open_scan_ = open->id;
    stored_.clear();
    const Scan& scan = scans_.at(open->id);
    JobOpened opened{open->id, std::make_shared<const machine::JobConfig>(scan.config), {}, {}};
    opened.progress.total = static_cast<std::int64_t>(scan.rows.size());
    for (const scan::PlanRow& row : scan.rows) {
      if (row.state == scan::RowState::pending) opened.pending.push_back(row);
      if (row.state == scan::RowState::done) ++opened.progress.done;
      if (row.state == scan::RowState::abandoned) ++opened.progress.abandoned;
    }
    opened.visits = scan.visits;
    opened.visits.poses_since_good = static_cast<std::int64_t>(scan.unproven.size());
    if (opened.progress.done > 0) {
      auto place = std::make_shared<PlaceReference>();
      place->target_rad = scan.rows.front().target_rad;
      place->exposure_s = 0.02;
      opened.place = std::move(place);
    }
    return answer(std::move(opened));
  }
  if (const auto* store = std::get_if<StoreFrame>(&action)) {
    release(store->slot);
    if (scan_folder_gone) return answer(StorageFailed{"the folder is gone", open_scan_});
    if (disk_refuses || chance(faults.disk)) return answer(no_room("no space left"));
    stored_[{store->pose.row, store->frame.index}] = true;
    return answer(FrameStored{store->pose.row, store->frame.index, "hash", store->pose.number});
  }
  if (const auto* commit = std::get_if<CommitPose>(&action)) {
    if (disk_refuses || chance(faults.disk)) return answer(no_room("no space left"));
    auto& row = scans_.at(open_scan_).rows.at(static_cast<std::size_t>(commit->pose.row));
    expect(row.state == scan::RowState::pending, "a pose is committed twice");
    row.state = scan::RowState::done;
    scans_.at(open_scan_).unproven.push_back(commit->pose.row);
    return answer(PoseCommitted{commit->pose.row});
  }
  if (const auto* look = std::get_if<JudgeLook>(&action)) return judge(*look);
  if (const auto* visit = std::get_if<RecordVisit>(&action)) return record(*visit);
  if (const auto* discard = std::get_if<DiscardBracket>(&action)) {
    std::erase_if(stored_, [&](const auto& frame) { return frame.first.first == discard->row; });
    return;
  }
  if (const auto* failure = std::get_if<RecordFailure>(&action)) {
    auto& row = scans_.at(open_scan_).rows.at(static_cast<std::size_t>(failure->row));
    expect(row.state == scan::RowState::pending, "a pose fails that has ended");
    ++row.attempts;
    row.reason = failure->reason;
    if (failure->abandon) row.state = scan::RowState::abandoned;
  }
}

void RigModel::judge(const JudgeLook& look) {
  release(look.slot);
  if (disk_refuses || chance(faults.disk)) return answer(no_room("the frame cannot be kept"));
  if (chance(faults.bad_visit)) {
    return answer(LookJudged{look.exposure, base::fail(base::ErrorCode::damaged, "it shows nothing")});
  }
  LookFinding finding;
  finding.record.name = look.name;
  finding.record.means_dn = {look.name == "dark" ? dark_dn : patch_dn};
  if (look.name == "flat") finding.record.means_dn = flat_dn;
  finding.tags = tags;
  finding.moved = moved;
  if (chance(faults.bad_visit)) {
    finding.record.means_dn = {500};
    finding.moved = "the fiducials by 9 px";
    finding.tags.clear();
  }
  answer(LookJudged{look.exposure, std::move(finding)});
}

void RigModel::record(const RecordVisit& action) {
  if (disk_refuses || chance(faults.disk)) return answer(no_room("no space left"));
  Scan& scan = scans_.at(open_scan_);
  VisitRecorded recorded{action.visit, {}, {}, {}};
  scan.visits.next = action.visit.number + 1;
  const bool any = std::any_of(scan.rows.begin(), scan.rows.end(),
                               [](const scan::PlanRow& row) { return row.state == scan::RowState::done; });
  if (action.retake == scan::Retake::since_good) recorded.again = scan.unproven;
  for (const scan::PlanRow& row : scan.rows) {
    const bool all = action.retake == scan::Retake::all;
    if (all && row.state == scan::RowState::done) recorded.again.push_back(row.row);
  }
  for (const std::int64_t row : recorded.again)
    scan.rows.at(static_cast<std::size_t>(row)).state = scan::RowState::pending;
  if (action.visit.good || action.retake != scan::Retake::none) scan.unproven.clear();
  if (action.visit.good) {
    const bool anew = !scan.visits.first || !any || action.retake == scan::Retake::all;
    if (anew) scan.visits.first = action.visit;
    scan.visits.agreed = anew ? 1 : scan.visits.agreed + 1;
    scan.visits.last_good = action.visit.when;
    scan.visits.since_good.clear();
  } else {
    scan.visits.since_good.push_back(action.visit);
  }
  recorded.progress.total = static_cast<std::int64_t>(scan.rows.size());
  for (const scan::PlanRow& row : scan.rows) {
    if (row.state == scan::RowState::pending) recorded.pending.push_back(row);
    if (row.state == scan::RowState::done) ++recorded.progress.done;
    if (row.state == scan::RowState::abandoned) ++recorded.progress.abandoned;
  }
  answer(std::move(recorded));
}

}  // namespace rig::daemon::testing
