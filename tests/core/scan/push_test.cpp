// A scan copied to another place while it grows.
#include "core/scan/push.h"

#include <cerrno>
#include <gmock/gmock.h>

#include "core/scan/verify.h"
#include "tests/core/scan/recorded_job.h"

namespace rig::scan::testing {
namespace {

using base::ErrorCode;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Push : public ::testing::Test {
 protected:
  [[nodiscard]] base::Result<PushReport> pushed() const { return push_scan(scan_.path(), to(), {}); }
  [[nodiscard]] PushReport expect_pushed() const {
    auto report = pushed();
    EXPECT_TRUE(report.has_value()) << report.error().text();
    return report.value_or(PushReport{});
  }
  [[nodiscard]] fs::path to() const { return folder_ / "copy"; }
  void expect_same_frames() const { EXPECT_TRUE(frames_below(scan_.path()) == frames_below(to())); }

  const SmallScan scan_;
  const test::TemporaryFolder folder_;
};

TEST_F(Push, ACompleteScanIsTheSameThere) {
  scan_.take_all();
  std::vector<std::size_t> left;
  const auto report = push_scan(scan_.path(), to(), [&left](std::size_t n) { left.push_back(n); });
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_TRUE(report->complete());
  EXPECT_EQ(report->frames_copied, static_cast<std::size_t>(kPoses * kFrames));
  EXPECT_EQ(left.size(), report->frames_copied);
  EXPECT_EQ(left.back(), 0U);
  EXPECT_TRUE(verify_scan(to(), {}).value().complete());
  expect_same_frames();
  EXPECT_EQ(test::bytes_in(to() / "job.toml"), job_text());
}

TEST_F(Push, OnlyCommittedPosesGoAndTheNextPushBringsTheRest) {
  scan_.take(0);
  scan_.take(1);
  (void)scan_.store(2, 0);
  {
    const PushReport report = expect_pushed();
    EXPECT_EQ(report.progress.done, 2);
    EXPECT_FALSE(report.complete());
    EXPECT_EQ(report.frames_copied, static_cast<std::size_t>(2 * kFrames));
    EXPECT_THAT(verify_scan(to(), {}).value().problems, IsEmpty());
  }
  scan_.take(2);
  scan_.take(3);
  const PushReport report = expect_pushed();
  EXPECT_EQ(report.frames_there, static_cast<std::size_t>(2 * kFrames));
  EXPECT_EQ(report.frames_copied, static_cast<std::size_t>(2 * kFrames));
  EXPECT_TRUE(verify_scan(to(), {}).value().complete());
  expect_same_frames();
  EXPECT_EQ(expect_pushed().frames_copied, 0U) << "nothing is left to do";
}

TEST_F(Push, GoesOnWhileTheJournalIsOpenAndGrows) {
  auto journal = Journal::open(journal_path(scan_.path())).value();
  ASSERT_TRUE(take_pose(scan_.path(), journal, 0, 1).has_value());
  EXPECT_EQ(expect_pushed().progress.done, 1);
  ASSERT_TRUE(take_pose(scan_.path(), journal, 1, 1).has_value());
  EXPECT_EQ(expect_pushed().progress.done, 2);
  EXPECT_THAT(verify_scan(to(), {}).value().problems, IsEmpty());
}

TEST_F(Push, FollowingEndsWithTheJob) {
  std::int64_t row = 0;
  const auto report = follow_scan(scan_.path(), to(), {}, [&](const PushReport& so_far) {
    EXPECT_EQ(so_far.progress.done, row);
    scan_.take(row++);
    return true;
  });
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_EQ(row, kPoses);
  EXPECT_TRUE(report->complete());
  EXPECT_EQ(report->frames_copied, static_cast<std::size_t>(kPoses * kFrames));
  EXPECT_TRUE(verify_scan(to(), {}).value().complete());
}

TEST_F(Push, FollowingCanBeEnded) {
  scan_.take(0);
  const auto report = follow_scan(scan_.path(), to(), {}, [](const PushReport&) { return false; });
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_EQ(report->progress.done, 1);
}

TEST_F(Push, APoseTakenAgainIsBroughtAgain) {
  scan_.take_all();
  (void)expect_pushed();
  scan_.take(2, 5);
  ASSERT_TRUE(discard_bracket(scan_.path(), 2).has_value());
  EXPECT_EQ(expect_pushed().frames_copied, static_cast<std::size_t>(kFrames));
  EXPECT_TRUE(verify_scan(to(), {}).value().complete());
  expect_same_frames();
}

TEST_F(Push, ADamagedFrameIsNamedAndTheOthersGo) {
  scan_.take_all();
  std::string bytes = test::bytes_in(scan_.frame(1, 1));
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  test::put_bytes(scan_.frame(1, 1), bytes);
  const PushReport report = expect_pushed();
  EXPECT_THAT(report.problems, ElementsAre(HasSubstr("frames/000001/01.tif")));
  EXPECT_FALSE(report.complete());
  EXPECT_EQ(report.frames_copied, static_cast<std::size_t>(kPoses * kFrames - 1));
}

TEST_F(Push, WhatWasDamagedThereIsMendedByADeletion) {
  scan_.take_all();
  (void)expect_pushed();
  fs::remove(to() / "frames/000001/01.tif");
  EXPECT_EQ(expect_pushed().frames_copied, 1U);
  expect_same_frames();
}

TEST_F(Push, RefusesAFolderThatIsSomethingElse) {
  scan_.take(0);
  fs::create_directory(to());
  test::put_bytes(to() / "notes.txt", "mine");
  auto refused = pushed();
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::refused);
  EXPECT_THAT(test::everything_in(to()), ElementsAre("notes.txt"));
  fs::remove(to() / "notes.txt");
  test::put_bytes(to() / "rig.toml", "of another scan");
  refused = pushed();
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().text(), HasSubstr("another scan"));
  for (const fs::path& inside : {scan_.path(), scan_.path() / "copy"}) {
    refused = push_scan(scan_.path(), inside, {});
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::refused);
  }
}

// Cut off at every operation: what is there is never wrong, and the next push finishes it.
TEST_F(Push, CutOffAtEveryMomentIsFinishedByTheNext) {
  scan_.take_all();
  bool failed = true;
  for (int n = 1; failed; n += 3) {
    SCOPED_TRACE(n);
    const fs::path root = folder_ / "disk";
    fs::create_directory(root);
    test::Recorded recorded(root);
    int seen = 0;
    recorded.log.refuse = [&](const test::Operation&) { return ++seen >= n ? ENOSPC : 0; };
    const auto cut = push_scan(scan_.path(), root / "copy", {});
    failed = seen >= n;
    EXPECT_NE(cut.has_value(), failed);
    recorded.log.refuse = nullptr;
    if (fs::exists(journal_path(root / "copy"))) {
      EXPECT_TRUE(verify_scan(root / "copy", {}).value().complete());
    }
    const auto again = push_scan(scan_.path(), root / "copy", {});
    ASSERT_TRUE(again.has_value()) << again.error().text();
    EXPECT_TRUE(verify_scan(root / "copy", {}).value().complete());
    fs::remove_all(root);
  }
}

}  // namespace
}  // namespace rig::scan::testing
