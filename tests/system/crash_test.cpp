// rigd is killed in the middle of a job, at moments that a seed chooses, and started again: the job goes on
// by itself, the scan is complete, and its frames are those of an undisturbed run, byte for byte.
#include <algorithm>
#include <cstdlib>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/scan/verify.h"
#include "tests/core/seed.h"
#include "tests/system/running_rig.h"
#include "tests/system/tiny_rig.h"

namespace rig::test {

namespace {

void expect_complete(const std::filesystem::path& scan) {
  const auto report = scan::verify_scan(scan, [](std::size_t) {});
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_TRUE(report->complete());
  for (const std::string& problem : report->problems) ADD_FAILURE() << problem;
}

// Ends rigd at the n-th event of the job.
void kill_at_event(RunningRig& rig, int n) {
  int seen = 0;
  ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
    return (event.has_pose_started() || event.has_pose_arrived() || event.has_frame_taken() ||
            event.has_pose_committed()) &&
           ++seen >= n;
  })) << rig.log();
  EXPECT_EQ(rig.end(SIGKILL), -SIGKILL);
}

}  // namespace

TEST(Crash, KilledThreeTimesTheScanIsTheSame) {
  TemporaryFolder folder;
  const std::string job = small_job(folder / "plan");
  RunningRig undisturbed(folder / "undisturbed");
  ASSERT_NO_FATAL_FAILURE(undisturbed.start());
  undisturbed.submit(job);
  ASSERT_EQ(undisturbed.await_job_end(), protocol::COMPLETE) << undisturbed.log();
  EXPECT_EQ(undisturbed.end(SIGTERM), 0) << undisturbed.log();
  expect_complete(undisturbed.scan());
  const auto expected = frames_of(undisturbed.scan());
  ASSERT_GE(expected.size(), 12U);

  base::Random random(seed(9));
  RunningRig rig(folder / "killed");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(job);
  for (int i = 0; i < 3; ++i) {
    // A pose has five events: each part of its way is a moment to die at. The job outlasts all three.
    const int n = 1 + static_cast<int>(random.uniform() * 9);
    SCOPED_TRACE(fmt::format("kill {} at event {}", i + 1, n));
    ASSERT_NO_FATAL_FAILURE(kill_at_event(rig, n));
    ASSERT_NO_FATAL_FAILURE(rig.start());
  }
  ASSERT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  expect_complete(rig.scan());
  const auto frames = frames_of(rig.scan());
  EXPECT_EQ(frames.size(), expected.size());
  for (const auto& [name, bytes] : expected) {
    const auto found = frames.find(name);
    ASSERT_NE(found, frames.end()) << name;
    EXPECT_TRUE(found->second == bytes) << name << " differs from the undisturbed scan's";
  }
}

// The programs started while it lives die at an instant of core/base/death.h.
class DeathAt {
 public:
  explicit DeathAt(const std::string& instant) { ::setenv("RIG_DIE_AT", instant.c_str(), 1); }
  ~DeathAt() { ::unsetenv("RIG_DIE_AT"); }
  DeathAt(const DeathAt&) = delete;
  DeathAt& operator=(const DeathAt&) = delete;
};

TEST(Crash, AtEachKindOfInstantNothingIsLost) {
  TemporaryFolder folder;
  const std::string job = tiny_job(30);
  RunningRig undisturbed(folder / "undisturbed", tiny_rig_toml());
  ASSERT_NO_FATAL_FAILURE(undisturbed.start());
  undisturbed.submit(job);
  ASSERT_EQ(undisturbed.await_job_end(), protocol::COMPLETE) << undisturbed.log();
  EXPECT_EQ(undisturbed.end(SIGTERM), 0) << undisturbed.log();

  RunningRig rig(folder / "killed", tiny_rig_toml());
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(job);
  ASSERT_TRUE(rig.await([](const protocol::Event& event) { return event.has_pose_committed(); }));
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  // Each is in the middle of the poses: what rigd writes to begin with are commits alone.
  const std::vector<std::string> instants{"before-write:3",   "after-write:4",   "before-flush:5",
                                          "after-flush:6",    "before-rename:2", "after-rename:2",
                                          "before-commit:20", "after-commit:21"};
  std::int64_t done = 1;
  for (const std::string& instant : instants) {
    SCOPED_TRACE(instant);
    const DeathAt death(instant);
    Program rigd("rigd",
                 {"--config", rig.folder() / "rig.toml", "--state", rig.folder() / "state", "--runtime",
                  rig.folder() / "run"},
                 rig.folder() / "rigd.log");
    ASSERT_TRUE(rigd.ends_within(kPatience)) << "the instant did not come";
    ASSERT_EQ(rigd.wait(), -SIGKILL) << rig.log();
    const auto report = scan::verify_scan(rig.scan(), {});
    ASSERT_TRUE(report.has_value()) << report.error().text();
    EXPECT_GE(report->progress.done, done) << "a pose that was committed is lost";
    done = report->progress.done;
    ASSERT_LT(done, report->progress.total) << "it died after the job";
  }
  ASSERT_NO_FATAL_FAILURE(rig.start());
  ASSERT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  protocol::Request ask;
  ask.mutable_get_report()->set_job(1);
  EXPECT_EQ(rig.expect_done(ask).report().restarts_us_size(), static_cast<int>(instants.size() + 1));
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  expect_complete(rig.scan());
  EXPECT_TRUE(frames_of(rig.scan()) == frames_of(undisturbed.scan()));
  EXPECT_NE(bytes_in(rig.scan() / "report.txt").find("Restarted: rigd was started anew 9 times"),
            std::string::npos);
}

// Whatever was on the disk when rigd died, the report of an aborted job is there once the next one runs, and
// somebody was told.
TEST(Crash, TheReportOfAnAbortedJobIsNeverLost) {
  TemporaryFolder folder;
  const std::string job =
      replaced(tiny_job(), "sample = \"chart\"", "sample = \"chart\"\nneeds_sample_change = true");
  int late = 0;
  bool survived = false;
  for (int n = 1; !survived; ++n) {
    ASSERT_LT(n, 200) << "every commit of rigd was died at, and more";
    SCOPED_TRACE(fmt::format("at commit {}", n));
    const std::filesystem::path told = folder / fmt::format("told-{}", n);
    RunningRig rig(
        folder / fmt::format("rig-{}", n),
        tiny_rig_toml() + fmt::format("\n[notify]\ncommand = [\"/bin/sh\", \"-c\", \"echo $1 >>{}\", "
                                      "\"notify\"]\n",
                                      told.string()));
    ASSERT_NO_FATAL_FAILURE(rig.start());
    rig.submit(job);
    ASSERT_EQ(rig.end(SIGTERM), 0) << rig.log();
    protocol::Request abort;
    abort.mutable_abort_job()->set_job(1);
    {
      const DeathAt death(fmt::format("after-commit:{}", n));
      Program rigd("rigd",
                   {"--config", rig.folder() / "rig.toml", "--state", rig.folder() / "state", "--runtime",
                    rig.folder() / "run"},
                   rig.folder() / "rigd.log");
      auto client = protocol::Client::connect("ipc://" + (rig.folder() / "run/operate.sock").string());
      ASSERT_TRUE(client.has_value()) << client.error().text();
      // It may die before it answers.
      bool answered = false;
      while (!answered && !rigd.ends_within(std::chrono::milliseconds(0)))
        answered = client->ask(abort, std::chrono::milliseconds(200)).has_value();
      const int status = rigd.signal(SIGTERM);
      survived = answered && status == 0;
      ASSERT_TRUE(survived || status == -SIGKILL) << rig.log();
    }
    const bool missing = !std::filesystem::exists(rig.scan() / "report.txt") ||
                         !std::filesystem::exists(told) ||
                         bytes_in(told).find("aborted") == std::string::npos;
    ASSERT_NO_FATAL_FAILURE(rig.start());
    protocol::Request show;
    show.mutable_show_job()->set_job(1);
    const bool was_aborted = rig.expect_done(show).job().state() == protocol::ABORTED;
    if (was_aborted && missing) ++late;
    if (!was_aborted) rig.expect_done(abort);
    EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
    EXPECT_NE(bytes_in(rig.scan() / "report.txt").find("aborted"), std::string::npos);
    EXPECT_NE(bytes_in(rig.scan() / "report.json").find("ABORTED"), std::string::npos);
    EXPECT_NE(bytes_in(told).find("aborted"), std::string::npos) << rig.log();
    EXPECT_FALSE(survived && missing);
    // And once it is told it stays so.
    if (survived) {
      const std::string heard = bytes_in(told);
      ASSERT_NO_FATAL_FAILURE(rig.start());
      EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
      EXPECT_EQ(bytes_in(told), heard);
    }
  }
  EXPECT_GT(late, 0) << "no death came between the end of the job and its report";
}

TEST(Crash, AnAskedEndIsNoCrash) {
  TemporaryFolder folder;
  const std::string job = small_job(folder / "plan");
  RunningRig rig(folder / "rig");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(job);
  ASSERT_TRUE(rig.await([](const protocol::Event& event) { return event.has_frame_taken(); }));
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  ASSERT_NO_FATAL_FAILURE(rig.start());
  EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0);
  expect_complete(rig.scan());
}

TEST(Crash, AStopIsRememberedAcrossACrash) {
  TemporaryFolder folder;
  const std::string job = small_job(folder / "plan");
  RunningRig rig(folder / "rig");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(job);
  ASSERT_TRUE(rig.await([](const protocol::Event& event) { return event.has_pose_arrived(); }));
  protocol::Request stop;
  stop.mutable_stop()->set_reason("a hand in the rig");
  rig.expect_done(stop);
  EXPECT_EQ(rig.end(SIGKILL), -SIGKILL);
  ASSERT_NO_FATAL_FAILURE(rig.start());
  protocol::Request look;
  look.mutable_get_status();
  const auto status = rig.expect_done(look).status();
  EXPECT_EQ(status.mode(), protocol::STOPPED);
  EXPECT_NE(status.stop_reason().find("a hand in the rig"), std::string::npos) << status.stop_reason();
  EXPECT_FALSE(status.light().shutter_open());
  protocol::Request clear;
  clear.mutable_clear_stop();
  rig.expect_done(clear);
  EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0);
  expect_complete(rig.scan());
}

}  // namespace rig::test
