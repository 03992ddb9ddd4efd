// A small job carried out on a scan folder as rigd does it, and what must be true of the folder after a
// crash. A pose fails once on its way, so that discarding and recording a failure are part of it.
#pragma once

#include <algorithm>
#include <gtest/gtest.h>
#include <map>
#include <set>
#include <string>

#include "core/scan/verify.h"
#include "tests/core/disk/recorded.h"
#include "tests/core/scan/small_scan.h"

namespace rig::scan::testing {

inline constexpr std::int64_t kFailingRow = 1;

/// Of the plan that job_text() has.
inline FrameFacts planned_facts(std::int64_t row, int index) {
  FrameFacts facts = some_facts(row, index);
  facts.target_rad = some_plan(kPoses)[static_cast<std::size_t>(row)];
  return facts;
}

/// Stores the whole bracket of a take; what is to be committed.
inline base::Result<PoseRecord> store_bracket(const fs::path& scan, std::int64_t row, int take) {
  PoseRecord pose = some_pose(row, 0);
  pose.attempt = take;
  for (int index = 0; index < kFrames; ++index) {
    const auto hash = store_frame(scan, planned_facts(row, index), kWidth, kHeight,
                                  SmallScan::pixels(row, index, take).data());
    if (!hash) return base::pass(hash);
    FrameRecord frame;
    frame.index = index;
    frame.file = fs::relative(frames_folder(scan, row) / frame_name(index), scan).string();
    frame.exposure_s = planned_facts(row, index).exposure_s;
    frame.sha256 = *hash;
    pose.frames.push_back(frame);
  }
  return pose;
}

inline base::Result<void> take_pose(const fs::path& scan, Journal& journal, std::int64_t row, int take) {
  const auto pose = store_bracket(scan, row, take);
  if (!pose) return base::pass(pose);
  if (auto ok = publish_bracket(scan, row); !ok) return ok;
  if (auto ok = journal.commit_pose(*pose, {some_event(1, static_cast<std::uint64_t>(row))}); !ok) return ok;
  return {};
}

/// From opening the scan to its last pose; the notes of what has been reached go to `log`.
inline base::Result<void> run_job(const fs::path& scan, test::OperationLog& log) {
  std::error_code error;
  if (!fs::exists(scan, error)) {
    if (auto ok = create_scan(scan, machine::shipped_rig_text(), job_text()); !ok) return ok;
  }
  log.note("created");
  auto journal = Journal::open(journal_path(scan));
  if (!journal) return base::pass(journal);
  if (auto ok = tidy_scan(scan, *journal); !ok) return ok;
  const auto pending = journal->pending(0, kPoses);
  if (!pending) return base::pass(pending);
  for (const PlanRow& row : *pending) {
    if (row.row == kFailingRow && row.attempts == 0) {
      const auto first = store_frame(scan, planned_facts(row.row, 0), kWidth, kHeight,
                                     SmallScan::pixels(row.row, 0, 7).data());
      if (!first) return base::pass(first);
      if (auto ok = discard_bracket(scan, row.row); !ok) return ok;
      if (auto ok = journal->record_failure(row.row, "did not arrive", false, {}); !ok) return ok;
      log.note("failed");
    }
    if (auto ok = take_pose(scan, *journal, row.row, 1); !ok) return ok;
    log.note("committed " + std::to_string(row.row));
    if (auto ok = discard_bracket(scan, row.row); !ok) return ok;
  }
  return {};
}

/// The finished job in a folder of its own.
class UndisturbedScan {
 public:
  UndisturbedScan() {
    const test::Recorded recorded(folder_.path());
    test::OperationLog unused(folder_.path());
    const auto done = run_job(path(), unused);
    EXPECT_TRUE(done.has_value()) << done.error().text();
  }
  [[nodiscard]] fs::path path() const { return folder_ / "scan"; }

 private:
  const test::TemporaryFolder folder_;
};

inline std::map<std::string, std::string> frames_below(const fs::path& scan) {
  std::map<std::string, std::string> frames;
  for (const std::string& name : test::everything_in(scan / "frames")) {
    const fs::path path = scan / "frames" / name;
    frames[name] = fs::is_directory(path) ? "folder" : test::bytes_in(path);
  }
  return frames;
}

/// What was reached by the n-th operation.
inline std::set<std::string> notes_before(const test::OperationLog& log, std::size_t n) {
  std::set<std::string> notes;
  for (std::size_t i = 0; i < n; ++i) {
    const test::Operation& operation = log.operations()[i];
    if (operation.kind == test::Operation::Kind::note) notes.insert(operation.path);
  }
  return notes;
}

/// Opens the scan as rigd does at its start; every pose must be there whole or pending, and none of those
/// that were reported as committed may be lost.
inline void expect_recovered(const fs::path& scan, const std::set<std::string>& reached) {
  // Only so that nothing is flushed.
  const test::Recorded recorded(scan.parent_path());
  if (!fs::exists(scan)) {
    EXPECT_EQ(reached.count("created"), 0U) << "the scan is lost";
    return;
  }
  {
    const auto journal = Journal::open(journal_path(scan));
    ASSERT_TRUE(journal.has_value()) << journal.error().text();
    const auto tidied = tidy_scan(scan, *journal);
    ASSERT_TRUE(tidied.has_value()) << tidied.error().text();
    const auto plan = journal->plan();
    ASSERT_TRUE(plan.has_value());
    ASSERT_EQ(plan->size(), static_cast<std::size_t>(kPoses));
    for (const PlanRow& row : *plan) {
      if (reached.count("committed " + std::to_string(row.row)) == 0) continue;
      EXPECT_EQ(row.state, RowState::done) << "row " << row.row << " was committed and is lost";
    }
    if (reached.count("failed") != 0) {
      EXPECT_EQ((*plan)[kFailingRow].attempts, 1);
    }
  }
  const auto report = verify_scan(scan, {});
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_THAT(report->problems, ::testing::IsEmpty());
}

}  // namespace rig::scan::testing
