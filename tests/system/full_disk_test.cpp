// The disk fills up, or becomes read-only, in the middle of a job: rigd suspends the job and says why, loses
// nothing, and goes on by itself once there is room. Real disks without room, where the system lets a test
// mount one; elsewhere the fault `disk-full` of faults_test.cpp stands for them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>

#include "core/scan/verify.h"
#include "tests/system/job_events.h"
#include "tests/system/running_rig.h"
#include "tests/system/small_disk.h"
#include "tests/system/tiny_rig.h"

namespace rig::test {
namespace {

using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

// Without a margin: the disk is full before rigd has seen that it is getting full.
std::string rig_without_margin() {
  return tiny_rig_toml() + "\n[suspend]\ndisk_margin_mb = 0.0\n";
}

class FullDisk : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!have_own_mounts()) GTEST_SKIP() << "the system allows no mounts here";
    std::filesystem::create_directories(folder_ / "rig");
    disk_.emplace(folder_ / "rig", 32);
    disk_->leave_free(10);
    rig_.emplace(folder_ / "rig", rig_without_margin());
    ASSERT_NO_FATAL_FAILURE(rig_->start());
    rig_->submit(tiny_job(30));
    ASSERT_TRUE(rig_->await([](const protocol::Event& event) { return event.has_pose_committed(); }))
        << rig_->log();
  }
  void TearDown() override { rig_.reset(); }  // before its disk

  void expect_suspension(const std::string& reason) {
    protocol::JobSuspended told;
    ASSERT_TRUE(rig_->await([&told](const protocol::Event& event) {
      if (event.has_job_suspended()) told = event.job_suspended();
      return event.has_job_suspended();
    })) << rig_->log();
    EXPECT_EQ(told.condition(), "disk");
    EXPECT_THAT(told.reason(), ContainsRegex(reason));
    EXPECT_THAT(told.reason(), HasSubstr((folder_ / "rig").string())) << "which disk";
    protocol::Request look;
    look.mutable_get_status();
    protocol::Status status = rig_->expect_done(look).status();
    // As read at its next look.
    const std::int64_t told_us = status.time_us();
    while (status.time_us() < told_us + 2'000'000) status = rig_->expect_done(look).status();
    EXPECT_NE(status.mode(), protocol::STOPPED) << status.stop_reason();
    EXPECT_EQ(status.job().state(), protocol::SUSPENDED);
    EXPECT_FALSE(status.light().shutter_open());
    // What was committed is there, and nothing else.
    const auto report = scan::verify_scan(rig_->scan(), {});
    ASSERT_TRUE(report.has_value()) << report.error().text();
    EXPECT_GE(report->progress.done, 1);
    EXPECT_LT(report->progress.done, report->progress.total);
    EXPECT_EQ(report->frames_checked, static_cast<std::size_t>(2 * report->progress.done));
  }
  void expect_release() {
    EXPECT_TRUE(rig_->await([](const protocol::Event& event) {
      return event.has_job_released() && event.job_released().condition() == "disk" &&
             event.job_released().goes_on();
    })) << rig_->log();
  }
  // Nobody asks rigd for anything.
  void expect_nothing_lost(const std::string& reason) {
    ASSERT_EQ(rig_->await_job_end(), protocol::COMPLETE) << rig_->log();
    EXPECT_EQ(rig_->end(SIGTERM), 0) << rig_->log();
    EXPECT_TRUE(scan::verify_scan(rig_->scan(), {}).value().complete());
    EXPECT_THAT(reasons_in_journal(rig_->scan()), Contains(ContainsRegex(reason)));
    EXPECT_THAT(bytes_in(rig_->scan() / "report.txt"), ContainsRegex("disk: .*" + reason));
    RunningRig calm(folder_ / "calm", rig_without_margin());
    ASSERT_NO_FATAL_FAILURE(calm.start());
    calm.submit(tiny_job(30));
    ASSERT_EQ(calm.await_job_end(), protocol::COMPLETE) << calm.log();
    EXPECT_EQ(calm.end(SIGTERM), 0);
    EXPECT_TRUE(frames_of(rig_->scan()) == frames_of(calm.scan())) << "differs from the undisturbed scan";
  }

  TemporaryFolder folder_;
  std::optional<SmallDisk> disk_;
  std::optional<RunningRig> rig_;
};

const char* const kNoRoom = "(No space left on device|disk is full)";

TEST_F(FullDisk, SuspendsTheJobWhichGoesOnByItself) {
  disk_->fill();
  ASSERT_NO_FATAL_FAILURE(expect_suspension(kNoRoom));
  disk_->make_room();
  expect_release();
  expect_nothing_lost(kNoRoom);
}

TEST_F(FullDisk, LosesNothingWhereRigdIsKilledMeanwhile) {
  disk_->fill();
  ASSERT_NO_FATAL_FAILURE(expect_suspension(kNoRoom));
  EXPECT_EQ(rig_->end(SIGKILL), -SIGKILL);
  disk_->make_room();
  ASSERT_NO_FATAL_FAILURE(rig_->start());
  ASSERT_EQ(rig_->await_job_end(), protocol::COMPLETE) << rig_->log();
  EXPECT_EQ(rig_->end(SIGTERM), 0) << rig_->log();
  EXPECT_TRUE(scan::verify_scan(rig_->scan(), {}).value().complete());
}

TEST_F(FullDisk, IsNoOtherWhereItIsReadOnly) {
  {
    const ReadOnlyFolder frames(rig_->scan() / "frames");
    ASSERT_NO_FATAL_FAILURE(expect_suspension("Read-only file system"));
  }
  expect_release();
  expect_nothing_lost("Read-only file system");
}

}  // namespace
}  // namespace rig::test
