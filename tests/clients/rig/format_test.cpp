// Messages as lines for a person.
#include "clients/rig/format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/progress.h"
#include "tests/clients/rig/fake_rigd.h"

namespace rig::client {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(DescribeJob, SaysOnlyWhatThereIsToSay) {
  EXPECT_EQ(describe_job(test::job_of(7, protocol::ACTIVE, 3)),
            "job 7 'night' (cloth): active, 3/4 poses, /scans/1");
  protocol::JobInfo job = test::job_of(8, protocol::JOB_FAILED, 1, "the disk is full");
  job.set_abandoned(2);
  job.set_retries(5);
  EXPECT_EQ(describe_job(job),
            "job 8 'night' (cloth): failed, 1/4 poses, 2 abandoned, 5 retries: the disk is full, /scans/1");
}

TEST(DescribeJob, KnowsEveryState) {
  for (const auto& [state, word] :
       {std::pair(protocol::QUEUED, ": queued,"), std::pair(protocol::ACTIVE, ": active,"),
        std::pair(protocol::COMPLETE, ": complete,"), std::pair(protocol::ABORTED, ": aborted,"),
        std::pair(protocol::JOB_FAILED, ": failed,"), std::pair(protocol::JOB_STATE_UNSPECIFIED, ": ?,")}) {
    EXPECT_THAT(describe_job(test::job_of(1, state)), HasSubstr(word));
  }
}

protocol::Status status_of(protocol::Mode mode) {
  protocol::Status status;
  status.set_rig_name("bench");
  status.set_rigd_version("0.1");
  status.set_mode(mode);
  return status;
}

TEST(DescribeStatus, KnowsEveryMode) {
  for (const auto& [mode, word] :
       {std::pair(protocol::IDLE, "idle"), std::pair(protocol::HOMING, "homing"),
        std::pair(protocol::MOVING, "moving"), std::pair(protocol::EXPOSING, "exposing"),
        std::pair(protocol::RUNNING, "running a job"), std::pair(protocol::STOPPED, "stopped"),
        std::pair(protocol::MODE_UNSPECIFIED, "?")}) {
    EXPECT_THAT(describe_status(status_of(mode)),
                testing::StartsWith(std::string("bench (rigd 0.1): ") + word + "\n"));
  }
}

TEST(DescribeStatus, IsATableOfTheRig) {
  protocol::Status status = status_of(protocol::STOPPED);
  status.set_stop_reason("door");
  auto& roll = *status.add_axes();
  roll.set_name("roll");
  roll.set_position_deg(-12.34567);
  roll.set_min_deg(-180);
  roll.set_max_deg(180);
  roll.set_homed(true);
  roll.set_moving(true);
  auto& arm = *status.add_axes();
  arm.set_name("arm");
  arm.set_position_deg(95);
  arm.set_min_deg(10);
  arm.set_max_deg(170.5);
  arm.set_fault("limit switch");
  auto& light = *status.mutable_light();
  light.set_on(true);
  light.set_level(0.5);
  light.set_warm(true);
  light.set_hours(12.345);
  *status.mutable_job() = test::job_of(7, protocol::ACTIVE, 3);
  EXPECT_EQ(describe_status(status),
            "bench (rigd 0.1): stopped: door\n"
            "  roll    -12.3457 deg  (-180.0 to 180.0)  homed, moving\n"
            "  arm      95.0000 deg  (10.0 to 170.5)  not homed, limit switch\n"
            "  light on, level 0.50, shutter shut, warm, 12.35 h\n"
            "  job 7 'night' (cloth): active, 3/4 poses, /scans/1\n");
  status.clear_job();
  EXPECT_THAT(describe_status(status), Not(HasSubstr("job")));
}

TEST(DescribeStatus, TellsOfLimitSwitches) {
  protocol::Status status = status_of(protocol::IDLE);
  auto& pan = *status.add_axes();
  pan.set_name("pan");
  pan.set_homed(true);
  pan.set_at_low_limit(true);
  EXPECT_THAT(describe_status(status), HasSubstr("  homed, on its low limit switch\n"));
  pan.set_at_low_limit(false);
  pan.set_at_high_limit(true);
  pan.set_fault("overload");
  EXPECT_THAT(describe_status(status), HasSubstr("  homed, on its high limit switch, overload\n"));
}

TEST(FormatDuration, RoundsToSeconds) {
  EXPECT_EQ(base::format_duration(0), "0:00");
  EXPECT_EQ(base::format_duration(0.6), "0:01");
  EXPECT_EQ(base::format_duration(41), "0:41");
  EXPECT_EQ(base::format_duration(59.6), "1:00");
  EXPECT_EQ(base::format_duration(3599.4), "59:59");
  EXPECT_EQ(base::format_duration(3599.6), "1:00:00");
  EXPECT_EQ(base::format_duration(3727), "1:02:07");
  EXPECT_EQ(base::format_duration(360000), "100:00:00");
}

}  // namespace
}  // namespace rig::client
