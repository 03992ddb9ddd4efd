// rigd as systemd sees it, and what rigd leaves behind for those who come in the morning.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/daemon/notify_socket.h"
#include "tests/system/running_rig.h"

namespace rig::test {

using testing::HasSubstr;

namespace {

// A variable that programs started meanwhile see.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) { ::setenv(name, value.c_str(), 1); }
  ~Variable() { ::unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

}  // namespace

TEST(Service, TellsThatItIsReadyAliveAndEnding) {
  const TemporaryFolder folder;
  const NotifySocket manager(folder / "notify");
  const Variable period("WATCHDOG_USEC", "400000");
  RunningRig rig(folder / "rig");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  ASSERT_TRUE(manager.await("READY=1", kPatience)) << rig.log();
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(manager.await("WATCHDOG=1", kPatience)) << rig.log();
  protocol::Request stop;
  stop.mutable_stop()->set_reason("a hand in the rig");
  rig.expect_done(stop);
  EXPECT_TRUE(manager.await("STATUS=stopped: a hand in the rig", kPatience));
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  EXPECT_TRUE(manager.await("STOPPING=1", kPatience));
}

TEST(Service, RefusesADriveThatHomesFasterThanItsReducedSpeed) {
  const TemporaryFolder folder;
  const auto config = folder / "rig.toml";
  const auto log = folder / "log";
  const auto starts = [&](const std::string& text) {
    put_bytes(config, text);
    return run_program("rigd",
                       {"--config", config.string(), "--state", (folder / "state").string(), "--runtime",
                        (folder / "run").string()},
                       log);
  };
  EXPECT_EQ(
      starts(replaced(small_rig_toml(), "homing_velocity_deg_s = 10.0", "homing_velocity_deg_s = 10.5")), 1);
  EXPECT_THAT(bytes_in(log), HasSubstr("axis.arm: it homes at 10.5 deg/s, faster than its reduced speed, "
                                       "jog_velocity_deg_s = 10"));
}

TEST(Service, AJobLeavesItsNumbersInTheLogAndInTheMetrics) {
  const TemporaryFolder folder;
  const std::string job = small_job(folder / "plan");
  RunningRig rig(folder / "rig");
  ASSERT_NO_FATAL_FAILURE(rig.start({"--statistics-s", "0.05"}));
  rig.submit(job);
  ASSERT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();

  const std::string endpoint = "ipc://" + (rig.folder() / "run/observe.sock").string();
  const auto metrics = [&](const std::string& format) {
    const auto out = folder / ("metrics" + format);
    EXPECT_EQ(run_program("rig", {"metrics", format, "--endpoint", endpoint}, out), 0) << bytes_in(out);
    return bytes_in(out);
  };
  const auto json = nlohmann::json::parse(metrics("--json"));
  const auto frames = frames_of(rig.scan()).size();
  EXPECT_EQ(json["rig_frames_total"], frames);
  EXPECT_EQ(json["rig_stores_total"], frames);
  EXPECT_EQ(json["rig_poses_committed_total"], frames / 2);
  EXPECT_EQ(json["rig_frame_slots_free"], json["rig_frame_slots"]);
  EXPECT_GT(json["rig_store_seconds_total"], 0);
  EXPECT_GT(json["rig_memory_bytes"], 1e6);
  EXPECT_GT(json["rig_disk_free_bytes"], 0);
  EXPECT_GT(json["rig_bus_transactions_total"]["virtual/axes"], frames);
  EXPECT_THAT(metrics("--prometheus"), HasSubstr("# TYPE rig_frames_total counter\nrig_frames_total "));
  EXPECT_EQ(rig.end(SIGTERM), 0);
  const std::string log = rig.log();
  EXPECT_THAT(log, HasSubstr("Stats: job 1 "));
  EXPECT_THAT(log, HasSubstr(fmt::format("job 1 is complete: {0} of {0} poses done", frames / 2)));
}

}  // namespace rig::test
