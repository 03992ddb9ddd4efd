// The disk fills up in the middle of a job: rigd stops and says why, loses nothing, and goes on once there is
// room and the stop is cleared. A limit on the size of its files stands for the full disk.
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "core/scan/verify.h"
#include "tests/system/running_rig.h"

namespace rig::test {
namespace {

// Less than a frame needs.
constexpr rlim_t kNoRoom = 100'000;

void limit_files_of(pid_t process, rlim_t most) {
  const rlimit limit{most, RLIM_INFINITY};
  ASSERT_EQ(::prlimit(process, RLIMIT_FSIZE, &limit, nullptr), 0);
}

}  // namespace

TEST(FullDisk, SuspendsTheJobAndLosesNothing) {
  TemporaryFolder folder;
  const std::string job = small_job(folder / "plan");
  RunningRig undisturbed(folder / "undisturbed");
  ASSERT_NO_FATAL_FAILURE(undisturbed.start());
  undisturbed.submit(job);
  ASSERT_EQ(undisturbed.await_job_end(), protocol::COMPLETE) << undisturbed.log();
  EXPECT_EQ(undisturbed.end(SIGTERM), 0);

  RunningRig rig(folder / "filled");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(job);
  ASSERT_TRUE(rig.await([](const protocol::Event& event) { return event.has_pose_committed(); }));
  ASSERT_NO_FATAL_FAILURE(limit_files_of(rig.pid(), kNoRoom));
  std::string reason;
  ASSERT_TRUE(rig.await([&reason](const protocol::Event& event) {
    reason = event.stop_latched().reason();
    return event.has_stop_latched();
  })) << rig.log();
  EXPECT_THAT(reason, ::testing::HasSubstr("disk"));
  EXPECT_THAT(reason, ::testing::HasSubstr(rig.scan().string())) << "which disk";

  protocol::Request look;
  look.mutable_show_job()->set_job(1);
  const protocol::JobInfo waiting = rig.expect_done(look).job();
  EXPECT_NE(waiting.state(), protocol::COMPLETE);
  EXPECT_NE(waiting.state(), protocol::JOB_FAILED);
  const auto report = scan::verify_scan(rig.scan(), {});
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_GE(report->progress.done, 1);
  EXPECT_EQ(report->frames_checked, static_cast<std::size_t>(2 * report->progress.done));

  ASSERT_NO_FATAL_FAILURE(limit_files_of(rig.pid(), RLIM_INFINITY));
  protocol::Request clear;
  clear.mutable_clear_stop();
  rig.expect_done(clear);
  ASSERT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  EXPECT_TRUE(scan::verify_scan(rig.scan(), {}).value().complete());
  EXPECT_TRUE(frames_of(rig.scan()) == frames_of(undisturbed.scan())) << "differs from the undisturbed scan";
}

}  // namespace rig::test
