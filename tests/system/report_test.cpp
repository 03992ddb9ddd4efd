// A night in small: a job waits for its sample, runs, and tells how it went, also to a client that was away
// while rigd was started again.
#include <gtest/gtest.h>

#include "tests/system/running_rig.h"
#include "tests/system/tiny_rig.h"

namespace rig::test {
namespace {

// Appends the occasion and the report to a file.
std::string notify_into(const std::string& told) {
  return fmt::format(
      "\n[notify]\ncommand = [\"/bin/sh\", \"-c\", \"echo $1 >>{0}; cat >>{0}\", \"notify\"]\n", told);
}

// rigd waits for its notifications when it ends.
std::string notified(RunningRig& rig, const std::string& told) {
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  return bytes_in(told);
}

TEST(Night, AJobThatWaitedForItsSampleReportsInTheMorning) {
  TemporaryFolder folder;
  const std::string told = (folder / "told").string();
  const std::string job = replaced(small_job(folder / "plan"), "sample = \"chart\"",
                                   "sample = \"chart\"\nneeds_sample_change = true");
  RunningRig rig(folder / "rig", small_rig_toml() + notify_into(told));
  ASSERT_NO_FATAL_FAILURE(rig.start());

  protocol::Request check;
  check.mutable_check_job()->set_job_toml(job);
  check.mutable_check_job()->set_scan_folder(rig.scan().string());
  const auto flight = rig.expect_done(check).preflight();
  EXPECT_TRUE(flight.ok());
  EXPECT_GT(flight.duration_s(), 10);
  EXPECT_GT(flight.bytes_free(), flight.bytes_needed());

  rig.submit(job);
  protocol::Event waits;
  ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
    waits = event;
    return event.has_job_suspended();
  })) << rig.log();
  EXPECT_EQ(waits.job_suspended().condition(), "sample change");
  // Answered behind all that the disk was asked before: the event is kept now.
  protocol::Request ask;
  ask.mutable_get_report()->set_job(1);
  rig.expect_done(ask);
  EXPECT_EQ(rig.end(SIGKILL), -SIGKILL);
  ASSERT_NO_FATAL_FAILURE(rig.start());

  // What was told before the restart can still be had.
  protocol::Request missed;
  missed.mutable_subscribe()->set_epoch(waits.epoch());
  missed.mutable_subscribe()->set_after(waits.number() - 1);
  const auto catch_up = rig.expect_done(missed).catch_up();
  EXPECT_FALSE(catch_up.truncated());
  ASSERT_GT(catch_up.missed_size(), 0);
  EXPECT_EQ(catch_up.missed(0).epoch(), waits.epoch());
  EXPECT_TRUE(catch_up.missed(0).has_job_suspended());

  protocol::Request release;
  release.mutable_release_job()->set_job(1);
  rig.expect_done(release);
  ASSERT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();

  const auto report = rig.expect_done(ask).report();
  EXPECT_EQ(report.poses_size(), report.job().poses());
  for (const auto& pose : report.poses()) EXPECT_EQ(pose.state(), "done");
  EXPECT_GT(report.bytes_used(), 0U);
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  const std::string text = bytes_in(rig.scan() / "report.txt");
  EXPECT_NE(text.find("sample change"), std::string::npos) << text;
  EXPECT_NE(bytes_in(rig.scan() / "report.json").find("\"suspensions\""), std::string::npos);
  EXPECT_NE(text.find("Restarted: rigd was started anew 1 time while"), std::string::npos) << text;
  const std::string heard = bytes_in(told);
  EXPECT_NE(heard.find("suspended\nJob 1"), std::string::npos) << heard;
  EXPECT_NE(heard.find("complete\nJob 1"), std::string::npos) << heard;
}

// Longer than a suspension may last, then given up by a person.
TEST(Night, AJobThatIsHeldAndThenAbortedTellsOfBoth) {
  TemporaryFolder folder;
  const std::string told = (folder / "told").string();
  RunningRig rig(folder / "rig",
                 tiny_rig_toml("[[module.settings.faults.fault]]\nkind = \"unplugged\"\ndevice = "
                               "\"camera\"\nfrom_s = 910\n") +
                     "\n[suspend]\nlimit_s = 60.0\n" + notify_into(told));
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(tiny_job());
  protocol::JobInfo held;
  ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
    if (event.has_job_changed()) held = event.job_changed().job();
    return held.state() == protocol::HELD;
  })) << rig.log();
  EXPECT_EQ(held.hold().find("suspended for more than 60 s: camera: "), 0U) << held.hold();
  EXPECT_NE(held.hold().find("is not connected"), std::string::npos) << held.hold();
  protocol::Request abort;
  abort.mutable_abort_job()->set_job(1);
  rig.expect_done(abort);
  EXPECT_EQ(rig.await_job_end(), protocol::ABORTED);
  const std::string heard = notified(rig, told);
  const auto suspended = heard.find("suspended\nJob 1 'tiny'");
  const auto was_held = heard.find("held\nJob 1 'tiny', sample 'chart': held");
  const auto aborted = heard.find("aborted\nJob 1 'tiny', sample 'chart': aborted");
  ASSERT_NE(suspended, std::string::npos) << heard;
  ASSERT_NE(was_held, std::string::npos) << heard;
  ASSERT_NE(aborted, std::string::npos) << heard;
  EXPECT_LT(suspended, was_held);
  EXPECT_LT(was_held, aborted);
  EXPECT_NE(heard.find("camera: is not connected", was_held), std::string::npos) << heard;
}

TEST(Night, AJobWhoseScanFolderVanishesFailsAndSaysSo) {
  TemporaryFolder folder;
  const std::string job = small_job(folder / "plan");
  const std::string told = (folder / "told").string();
  RunningRig rig(folder / "rig", small_rig_toml() + notify_into(told));
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(job);
  ASSERT_TRUE(rig.await([](const protocol::Event& event) { return event.has_pose_committed(); }));
  std::filesystem::rename(rig.scan(), rig.folder() / "elsewhere");
  EXPECT_EQ(rig.await_job_end(), protocol::JOB_FAILED) << rig.log();
  EXPECT_FALSE(std::filesystem::exists(rig.scan()));
  protocol::Request show;
  show.mutable_show_job()->set_job(1);
  EXPECT_NE(rig.expect_done(show).job().reason().find("no longer there"), std::string::npos);
  const std::string heard = notified(rig, told);
  EXPECT_NE(heard.find("failed\nJob 1 'small', sample 'chart': failed"), std::string::npos) << heard;
  EXPECT_NE(heard.find("no longer there"), std::string::npos) << heard;
}

}  // namespace
}  // namespace rig::test
