// Every fault of the virtual rig, caused and ended while rigd runs: what must happen, seen on the event
// stream, in the journal, in the report and in the frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scan/scan_directory.h"
#include "core/scan/verify.h"
#include "tests/system/job_events.h"
#include "tests/system/running_rig.h"
#include "tests/system/tiny_rig.h"

namespace rig::test {
namespace {

using ::testing::Contains;
using ::testing::ContainsRegex;

// Painted patches are the same at every visit, as the pose is.
const char* const kVisits =
    "\n[reference]\npose_deg = [0.0, 10.0, 0.0, 75.0]\nexposure_ms = 30.0\ndark_exposure_ms = 30.0\n"
    "every_poses = 3\nband = 0.1\nevenness = 0.5\ndark_dn = 100.0\nattempts = 20\nagain_min = 0.1\n";

constexpr const char* kRestartedOnce = "Restarted: rigd was started anew 1 time ";

class Fault : public ::testing::Test {
 protected:
  explicit Fault(const std::string& rig_toml = tiny_rig_toml()) : rig_(folder_ / "rig", rig_toml) {}

  std::vector<std::string> told_;  // reasons that were heard of, as expressions
  TemporaryFolder folder_;
  RunningRig rig_;

  // Written whole, so that the rig never reads half of it.
  void cause(const std::string& faults) {
    std::filesystem::create_directories(folder_ / "rig/state/virtual");
    put_bytes(folder_ / "rig/faults.new", faults);
    std::filesystem::rename(folder_ / "rig/faults.new", folder_ / "rig/state/virtual/faults.toml");
  }
  void mend() { std::filesystem::remove(folder_ / "rig/state/virtual/faults.toml"); }

  void begin(const std::string& job = tiny_job()) {
    ASSERT_NO_FATAL_FAILURE(rig_.start());
    rig_.submit(job);
  }
  void expect_stop(const std::string& reason) {
    std::string told;
    ASSERT_TRUE(rig_.await([&](const protocol::Event& event) {
      if (event.has_stop_latched()) told = event.stop_latched().reason();
      return event.has_stop_latched();
    })) << rig_.log();
    EXPECT_THAT(told, ContainsRegex(reason));
    told_.push_back(reason);
    protocol::Request look;
    look.mutable_get_status();
    const auto status = rig_.expect_done(look).status();
    EXPECT_EQ(status.mode(), protocol::STOPPED);
    EXPECT_THAT(status.stop_reason(), ContainsRegex(reason));
  }
  protocol::Outcome clear() {
    protocol::Request request;
    request.mutable_clear_stop();
    return rig_.ask(request).outcome();
  }
  // The next pose that fails does so for this reason.
  protocol::PoseFailed expect_failure(const std::string& reason) {
    protocol::PoseFailed failed;
    EXPECT_TRUE(rig_.await([&](const protocol::Event& event) {
      if (event.has_pose_failed()) failed = event.pose_failed();
      return event.has_pose_failed();
    })) << rig_.log();
    EXPECT_THAT(failed.reason(), ContainsRegex(reason));
    told_.push_back(reason);
    return failed;
  }
  void finish() {
    EXPECT_EQ(rig_.await_job_end(), protocol::COMPLETE) << rig_.log();
    EXPECT_EQ(rig_.end(SIGTERM), 0) << rig_.log();
    expect_told_of(rig_);
  }
  // The journal has each reason, and whoever comes in the morning reads of it.
  void expect_told_of(const RunningRig& rig) const {
    const std::string report = bytes_in(rig.scan() / "report.txt");
    const auto kept = reasons_in_journal(rig.scan());
    for (const std::string& reason : told_) {
      EXPECT_THAT(report, ContainsRegex(reason));
      EXPECT_THAT(kept, Contains(ContainsRegex(reason)));
    }
  }
  // The job waits, and no stop is latched.
  void expect_suspension(const std::string& condition, const std::string& reason) {
    protocol::JobSuspended told;
    ASSERT_TRUE(rig_.await([&](const protocol::Event& event) {
      EXPECT_FALSE(event.has_stop_latched()) << event.stop_latched().reason();
      if (event.has_job_suspended()) told = event.job_suspended();
      return event.has_job_suspended();
    })) << rig_.log();
    EXPECT_EQ(told.condition(), condition);
    EXPECT_THAT(told.reason(), ContainsRegex(reason));
    told_.push_back(reason);
  }
  protocol::Status status() {
    protocol::Request look;
    look.mutable_get_status();
    return rig_.expect_done(look).status();
  }
  // Until every axis was read once more.
  void wait_for_readings() {
    const std::int64_t now_us = status().time_us();
    while (status().time_us() < now_us + 2'000'000) {
    }
  }
  // After a start and after a stop every axis and every limit line has to be read first.
  protocol::Reply ask_once_known(const protocol::Request& request) {
    protocol::Reply reply = rig_.ask(request);
    while (reply.reason().find("is not known") != std::string::npos) reply = rig_.ask(request);
    return reply;
  }
  protocol::Reply move_pan(double to_deg) {
    protocol::Request request;
    auto& axis = *request.mutable_move()->add_axes();
    axis.set_axis("pan");
    axis.set_angle_deg(to_deg);
    return ask_once_known(request);
  }
  protocol::Reply jog_pan(double by_deg) {
    protocol::Request request;
    request.mutable_jog()->set_axis("pan");
    request.mutable_jog()->set_by_deg(by_deg);
    return ask_once_known(request);
  }
  void hold() {
    protocol::Request request;
    request.mutable_hold_job()->set_job(1);
    rig_.expect_done(request);
  }
  void release() {
    protocol::Request request;
    request.mutable_release_job()->set_job(1);
    rig_.expect_done(request);
  }
  [[nodiscard]] scan::ScanView view() const {
    auto scan = scan::open_scan(rig_.scan());
    EXPECT_TRUE(scan.has_value()) << scan.error().text();
    return std::move(scan).value();
  }
  void expect_undamaged(bool complete) {
    const auto report = scan::verify_scan(rig_.scan(), [](std::size_t) {});
    ASSERT_TRUE(report.has_value()) << report.error().text();
    EXPECT_THAT(report->problems, ::testing::IsEmpty());
    EXPECT_EQ(report->complete(), complete);
    EXPECT_EQ(report->progress.done + report->progress.abandoned, report->progress.total);
  }
  std::map<std::string, std::string> undisturbed(const std::string& rig_toml = tiny_rig_toml()) {
    RunningRig calm(folder_ / "calm", rig_toml);
    calm.start();
    calm.submit(tiny_job());
    EXPECT_EQ(calm.await_job_end(), protocol::COMPLETE) << calm.log();
    EXPECT_EQ(calm.end(SIGTERM), 0) << calm.log();
    return frames_of(calm.scan());
  }
  void expect_nothing_lost() {
    finish();
    expect_undamaged(true);
    EXPECT_TRUE(frames_of(rig_.scan()) == undisturbed());
  }
};

TEST_F(Fault, AStalledAxisStopsTheRigAndThePoseIsTakenAfterTheStop) {
  cause(
      "[[fault]]\nkind = \"stall\"\ndevice = \"pan\"\nafter = 2\ntimes = 1\nshare = 0.1\n");  // homing is one
  begin();
  expect_stop("axis pan stalled at .* predicted");
  EXPECT_EQ(clear(), protocol::DONE);
  expect_nothing_lost();
}

TEST_F(Fault, AStalledHomingStopsTheRig) {
  cause("[[fault]]\nkind = \"stall\"\ndevice = \"tilt\"\ntimes = 1\n");
  begin();
  expect_stop("the motion of tilt did not end in time");
  EXPECT_EQ(clear(), protocol::DONE);
  expect_nothing_lost();
}

// The readback is right, so that rigd cannot know and tells of nothing: the registration finds it. Homing
// sets it right again.
TEST_F(Fault, LostStepsMoveTheImageAndNothingElse) {
  cause("[[fault]]\nkind = \"lost-steps\"\ndevice = \"roll\"\nby_deg = 0.5\nafter = 4\ntimes = 1\n");
  begin();
  finish();
  expect_undamaged(true);
  EXPECT_THAT(reasons_in_journal(rig_.scan()), ::testing::IsEmpty());
  const auto expected = undisturbed();
  const auto frames = frames_of(rig_.scan());
  EXPECT_TRUE(frames.at("000000/00.tif") == expected.at("000000/00.tif"));
  EXPECT_FALSE(frames.at("000005/00.tif") == expected.at("000005/00.tif"));
}

TEST_F(Fault, MoreBacklashChangesNothingBecauseEveryTargetIsReachedFromBelow) {
  cause("[[fault]]\nkind = \"backlash\"\nby_deg = 3\n");
  begin();
  expect_nothing_lost();
}

// Down is further in, and every way down begins with a detour below its target.
TEST_F(Fault, AStuckLimitSwitchRefusesFurtherInAndAllowsOut) {
  cause("[[fault]]\nkind = \"limit-switch\"\ndevice = \"arm\"\nside = \"low\"\n");
  begin(tiny_job(6, 2));
  const auto first = expect_failure("axis arm stands on its low limit switch");
  EXPECT_FALSE(first.abandoned());
  const auto second = expect_failure("axis arm stands on its low limit switch");
  EXPECT_TRUE(second.abandoned());
  EXPECT_EQ(second.row(), 1);
  finish();
  expect_undamaged(false);
  const auto plan = view().plan;
  EXPECT_EQ(plan[0].state, scan::RowState::done);
  for (std::size_t row = 1; row < plan.size(); ++row) {
    EXPECT_EQ(plan[row].state, scan::RowState::abandoned);
    EXPECT_THAT(plan[row].reason, ContainsRegex("axis arm stands on its low limit switch"));
  }
}

TEST_F(Fault, ALimitSwitchReachedOnTheWayStopsTheRig) {
  cause("[[fault]]\nkind = \"limit-switch\"\ndevice = \"pan\"\nside = \"low\"\nchance = 0.5\n");
  begin(tiny_job(6, 20));  // standing on it is a pose that fails
  expect_stop("axis pan ran into its low limit switch");
  mend();
  EXPECT_EQ(clear(), protocol::DONE);
  expect_nothing_lost();
}

// The switch stays pressed after the stop: a person drives the axis out of it, and only out.
TEST_F(Fault, AnAxisThatRanIntoItsSwitchIsDrivenOutOfIt) {
  cause("[[fault]]\nkind = \"limit-switch\"\ndevice = \"pan\"\nside = \"low\"\nchance = 0.5\n");
  begin(tiny_job(6, 20));
  expect_stop("axis pan ran into its low limit switch");
  cause("[[fault]]\nkind = \"limit-switch\"\ndevice = \"pan\"\nside = \"low\"\n");
  hold();
  EXPECT_EQ(clear(), protocol::DONE);
  while (!status().job().resting()) {
  }
  wait_for_readings();
  const double here_deg = status().axes(2).position_deg();
  const protocol::Reply further_in = move_pan(here_deg - 5);
  EXPECT_EQ(further_in.outcome(), protocol::REFUSED);
  EXPECT_THAT(further_in.reason(), ContainsRegex("axis pan stands on its low limit switch"));
  const protocol::Reply out = move_pan(here_deg + 5);
  EXPECT_EQ(out.outcome(), protocol::DONE) << out.reason();
  EXPECT_NEAR(status().axes(2).position_deg(), here_deg + 5, 0.01);
  mend();  // it is out
  wait_for_readings();
  const protocol::Reply back = move_pan(here_deg);
  EXPECT_EQ(back.outcome(), protocol::DONE) << back.reason();
  release();
  expect_nothing_lost();
}

// The tiny rig with pan's limit switches on lines. `low_deg`: where the low one stands.
std::string with_limit_lines(double low_deg) {
  std::string text = tiny_rig_toml();
  const std::string stop = "low_deg = -95.0";
  const auto at = text.find(stop);
  EXPECT_NE(at, std::string::npos);
  text.insert(at + stop.size(), fmt::format("\nlow_switch_deg = {:.1f}", low_deg));
  for (const char* end : {"low", "high"}) {
    text += fmt::format(
        "\n[lines.limit.pan.{0}]\nmodule = \"virtual\"\ndevice = \"lines\"\nline = \"pan_{0}\"\n", end);
  }
  return text;
}

class FaultOfLimitLines : public Fault {
 protected:
  // The job goes down to -40 degrees.
  FaultOfLimitLines() : Fault(with_limit_lines(-44)) {}
};

TEST_F(FaultOfLimitLines, ThereIsNoneWhereNoneIsReached) {
  begin();
  expect_nothing_lost();
}

TEST_F(FaultOfLimitLines, OneThatIsActiveOnTheWayStopsTheRig) {
  cause("[[fault]]\nkind = \"limit-line\"\ndevice = \"pan\"\nside = \"low\"\nfrom_s = 905\nchance = 0.2\n");
  begin(tiny_job(6, 20));  // standing on it is a pose that fails
  expect_stop("axis pan ran into its low limit switch");
  mend();
  EXPECT_EQ(clear(), protocol::DONE);
  expect_nothing_lost();
}

// The drive believes to be 8 degrees from where it is, and has no switch there.
TEST_F(FaultOfLimitLines, AnAxisThatLostStepsRunsIntoItsSwitchAndIsDrivenOutAndHomed) {
  cause("[[fault]]\nkind = \"lost-steps\"\ndevice = \"pan\"\nby_deg = -8\nafter = 1\ntimes = 1\n");
  begin();
  expect_stop("axis pan ran into its low limit switch");
  hold();
  EXPECT_EQ(clear(), protocol::DONE);
  while (!status().job().resting()) {
  }
  wait_for_readings();
  EXPECT_TRUE(status().axes(2).at_low_limit());
  const double here_deg = status().axes(2).position_deg();
  EXPECT_LT(here_deg - 8, -44);
  // Fifty milliseconds at 60 degrees/s, some more for the calls, and the way in which it brakes.
  EXPECT_GT(here_deg - 8, -44 - 60 * 0.1 - 60 * 60 / (2 * 120.0));
  const protocol::Reply further_in = move_pan(here_deg - 5);
  EXPECT_EQ(further_in.outcome(), protocol::REFUSED);
  EXPECT_THAT(further_in.reason(), ContainsRegex("axis pan stands on its low limit switch"));
  const protocol::Reply out = move_pan(-20);
  EXPECT_EQ(out.outcome(), protocol::DONE) << out.reason();
  wait_for_readings();
  EXPECT_FALSE(status().axes(2).at_low_limit());
  protocol::Request home;
  home.mutable_home()->add_axes("pan");
  rig_.expect_done(home);
  release();
  expect_nothing_lost();
}

TEST_F(FaultOfLimitLines, LinesThatAreUnpluggedSuspendTheJobWhichGoesOnByItself) {
  cause("[[fault]]\nkind = \"unplugged\"\ndevice = \"lines\"\nfrom_s = 910\ntimes = 3\n");
  begin();
  expect_suspension("device lost", "lines: is not connected");
  expect_nothing_lost();
}

class FaultOfLimitLinesBeforeHoming : public Fault {
 protected:
  FaultOfLimitLinesBeforeHoming() : Fault(with_limit_lines(2)) {}  // pan stands at 5 degrees
};

TEST_F(FaultOfLimitLinesBeforeHoming, AJogIntoTheSwitchStopsAndOnlyOutIsAllowed) {
  ASSERT_NO_FATAL_FAILURE(rig_.start());
  const protocol::Reply in = jog_pan(-9);
  EXPECT_EQ(in.outcome(), protocol::FAILED);
  EXPECT_THAT(in.reason(), ContainsRegex("axis pan ran into its low limit switch"));
  expect_stop("axis pan ran into its low limit switch");
  EXPECT_EQ(clear(), protocol::DONE);
  wait_for_readings();
  EXPECT_TRUE(status().axes(2).at_low_limit());
  const protocol::Reply further_in = jog_pan(-1);
  EXPECT_EQ(further_in.outcome(), protocol::REFUSED);
  EXPECT_THAT(further_in.reason(), ContainsRegex("axis pan stands on its low limit switch"));
  const protocol::Reply out = jog_pan(6);
  EXPECT_EQ(out.outcome(), protocol::DONE) << out.reason();
  wait_for_readings();
  EXPECT_FALSE(status().axes(2).at_low_limit());
}

TEST(LimitLine, OneThatIsNotThereIsSaid) {
  const TemporaryFolder folder;
  put_bytes(folder / "rig.toml",
            tiny_rig_toml() +
                "\n[lines.limit.arm.low]\nmodule = \"virtual\"\ndevice = \"lines\"\nline = \"elbow_low\"\n");
  const int status = run_program(
      "rigd", {"--config", folder / "rig.toml", "--state", folder / "state", "--runtime", folder / "run"},
      folder / "log");
  EXPECT_NE(status, 0);
  EXPECT_THAT(bytes_in(folder / "log"),
              ContainsRegex("lines.limit.arm.low: there is no input line 'elbow_low'"));
}

TEST_F(Fault, TheEmergencyStopLatchesUntilItIsReleasedAndCleared) {
  cause("[[fault]]\nkind = \"emergency-stop\"\nby_s = 0.2\nfrom_s = 910\n");  // among the poses
  begin();
  expect_stop("emergency stop");
  EXPECT_EQ(clear(), protocol::REFUSED);
  mend();
  while (clear() == protocol::REFUSED) {
  }
  expect_nothing_lost();
}

TEST_F(Fault, ACallThatIsSlowWithinItsBoundIsWaitedFor) {
  cause("[[fault]]\nkind = \"slow\"\ndevice = \"tilt\"\nby_s = 0.3\nchance = 0.5\n");
  begin();
  expect_nothing_lost();
}

TEST_F(Fault, ACallThatOutlastsItsBoundStopsTheRig) {
  for (const auto& [device, what] : {std::pair("tilt", "axis tilt: a .* took longer than 1 s"),
                                     std::pair("camera", "camera: .* took longer than (2|30) s"),
                                     std::pair("light", "light: .* took longer than 2 s"),
                                     std::pair("lines", "lines: .* took longer than 1 s")}) {
    SCOPED_TRACE(device);
    TemporaryFolder folder;
    RunningRig rig(folder / "rig",
                   tiny_rig_toml(fmt::format("[[module.settings.faults.fault]]\nkind = \"slow\"\ndevice = "
                                             "\"{}\"\nby_s = 40\nafter = 4\ntimes = 1\n",
                                             device)));
    ASSERT_NO_FATAL_FAILURE(rig.start());
    rig.submit(tiny_job());
    std::string told;
    ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
      told = event.stop_latched().reason();
      return event.has_stop_latched();
    })) << rig.log();
    EXPECT_THAT(told, ContainsRegex(what));
    protocol::Request clear;
    clear.mutable_clear_stop();
    rig.expect_done(clear);
    EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
    EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
    told_ = {what};
    expect_told_of(rig);
  }
}

TEST_F(Fault, ReadingsThatAreNoNumbersStopTheRig) {
  begin();
  for (const auto& [device, what] :
       {std::pair("arm", "axis arm reports no position"), std::pair("light", "the light reports no level"),
        std::pair("lines", "lines: a reading of 0 lines")}) {
    SCOPED_TRACE(device);
    cause(fmt::format("[[fault]]\nkind = \"garbage\"\ndevice = \"{}\"\ntimes = 1\n", device));
    expect_stop(what);
    mend();
    EXPECT_EQ(clear(), protocol::DONE);
  }
  expect_nothing_lost();
}

TEST_F(Fault, AFrameThatIsNoneIsRefusedAndItsPoseTakenAgain) {
  cause(
      "[[fault]]\nkind = \"corrupt-frame\"\nafter = 2\ntimes = 1\n"
      "[[fault]]\nkind = \"dropped-frame\"\nafter = 5\ntimes = 1\n"
      "[[fault]]\nkind = \"garbage\"\ndevice = \"camera\"\nafter = 8\ntimes = 1\n");
  begin();
  EXPECT_FALSE(expect_failure("a frame: (line .* is all zeros|pixel .* beyond the 12 bits)").abandoned());
  EXPECT_FALSE(expect_failure("a frame: the camera delivered none in time").abandoned());
  EXPECT_FALSE(expect_failure("a frame: the camera does not say how it exposed").abandoned());
  finish();
  expect_undamaged(true);
  int retried = 0;
  for (const scan::PlanRow& row : view().plan) retried += row.attempts;
  EXPECT_EQ(retried, 3);
  EXPECT_TRUE(frames_of(rig_.scan()) == undisturbed());
}

TEST_F(Fault, AFrameOfWhichAPartNeverCameIsTakenAgain) {
  cause("[[fault]]\nkind = \"incomplete-frame\"\nafter = 2\ntimes = 2\n");
  begin();
  EXPECT_FALSE(expect_failure("a frame: camera: part of the frame never came").abandoned());
  EXPECT_FALSE(expect_failure("a frame: camera: part of the frame never came").abandoned());
  expect_nothing_lost();
}

TEST_F(Fault, ACameraThatNeverSendsAWholeFrameStopsTheRig) {
  cause("[[fault]]\nkind = \"incomplete-frame\"\n");
  begin(tiny_job(6, 2));
  expect_stop(
      "5 frames one after the other were no good, the last one: camera: part of the frame never came");
  mend();
  EXPECT_EQ(clear(), protocol::DONE);
  finish();
}

// The pose is taken again 1 s after its frame was given up.
TEST_F(Fault, ACameraThatIsBusyAfterAnAbortIsTriggeredAgain) {
  cause(
      "[[fault]]\nkind = \"dropped-frame\"\nafter = 2\ntimes = 1\n"
      "[[fault]]\nkind = \"busy\"\nby_s = 2.5\ntimes = 1\n");
  begin();
  EXPECT_FALSE(expect_failure("a frame: the camera delivered none in time").abandoned());
  expect_nothing_lost();
}

TEST_F(Fault, ACameraThatStaysBusyStopsTheRig) {
  cause(
      "[[fault]]\nkind = \"dropped-frame\"\nafter = 2\ntimes = 1\n"
      "[[fault]]\nkind = \"busy\"\nby_s = 60\ntimes = 1\n");
  begin();
  expect_stop("the camera takes no trigger: camera: the camera is exposing");
  EXPECT_EQ(rig_.end(SIGTERM), 0) << rig_.log();
}

TEST_F(Fault, APoseWhoseFramesAreNeverGoodIsAbandonedAndAfterFiveTheRigStops) {
  cause("[[fault]]\nkind = \"corrupt-frame\"\n");
  begin(tiny_job(6, 2));
  EXPECT_FALSE(expect_failure("a frame: ").abandoned());
  EXPECT_TRUE(expect_failure("a frame: ").abandoned());
  expect_stop("5 frames one after the other were no good, the last one: (line|pixel)");
  mend();
  EXPECT_EQ(clear(), protocol::DONE);
  finish();
  expect_undamaged(false);
  EXPECT_EQ(view().plan[0].state, scan::RowState::abandoned);
  EXPECT_THAT(view().plan[0].reason, ContainsRegex("a frame: "));
}

TEST_F(Fault, ACameraThatIsLostStopsTheRigAndIsUsedAgainWhenItIsBack) {
  cause("[[fault]]\nkind = \"lost\"\ndevice = \"camera\"\nafter = 7\n");
  begin();
  expect_stop("camera: .*does not answer any more");
  EXPECT_EQ(clear(), protocol::DONE);
  expect_stop("camera: .*does not answer any more");  // it is still gone
  mend();
  EXPECT_EQ(clear(), protocol::DONE);
  expect_nothing_lost();
}

TEST_F(Fault, ADeviceThatIsUnpluggedSuspendsTheJobWhichGoesOnByItself) {
  cause(
      "[[fault]]\nkind = \"unplugged\"\ndevice = \"camera\"\nafter = 7\ntimes = 3\n"
      "[[fault]]\nkind = \"unplugged\"\ndevice = \"tilt\"\nfrom_s = 930\ntimes = 4\n");
  begin();
  expect_suspension("device lost", "camera: is not connected");
  expect_suspension("device lost", "tilt: is not connected");
  expect_nothing_lost();
}

TEST_F(Fault, AFullDiskSuspendsTheJobWhichGoesOnByItself) {
  cause("[[fault]]\nkind = \"disk-full\"\nby_s = 8\nfrom_s = 910\ntimes = 1\n");
  begin();
  expect_suspension("disk", "the scan's disk: .*(File too large|disk I/O error)");
  expect_nothing_lost();
}

TEST_F(Fault, ALampThatGoesOutStopsTheRigAndIsWarmedUpAgain) {
  cause("[[fault]]\nkind = \"light-fails\"\ntimes = 1\nfrom_s = 910\n");
  begin();
  expect_stop("the light: the lamp went out");
  EXPECT_EQ(clear(), protocol::DONE);
  expect_nothing_lost();
}

TEST_F(Fault, DriftIsAFunctionOfTheTargetAngles) {
  const std::string drift = "[[module.settings.faults.fault]]\nkind = \"light-drift\"\nshare = 0.03\n";
  const auto once = undisturbed(tiny_rig_toml(drift));
  cause("[[fault]]\nkind = \"light-drift\"\nshare = 0.03\n[[fault]]\nkind = \"dropped-frame\"\ntimes = 2\n");
  begin();
  finish();
  expect_undamaged(true);
  EXPECT_TRUE(frames_of(rig_.scan()) == once);
}

TEST_F(Fault, AnExcursionOfTheLightChangesTheFramesOfItsTime) {
  // The lamp is warm after 900 s, and a pose takes a few seconds.
  cause("[[fault]]\nkind = \"light-excursion\"\nshare = -0.2\nfrom_s = 920\nfor_s = 10\n");
  begin();
  finish();
  expect_undamaged(true);
  const auto expected = undisturbed();
  std::size_t changed = 0;
  for (const auto& [name, bytes] : frames_of(rig_.scan())) changed += bytes == expected.at(name) ? 0 : 1;
  EXPECT_GT(changed, 0U);
  EXPECT_LT(changed, expected.size());
}

// Where the light is visited, it is found: the poses that it spoiled are taken again.
TEST_F(Fault, AnExcursionThatAReferenceVisitSeesCostsThePosesSinceTheLastGoodOne) {
  RunningRig rig(folder_ / "visited", tiny_rig_toml() + kVisits);
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(tiny_job(8));
  ASSERT_TRUE(rig.await([](const protocol::Event& event) { return event.has_pose_committed(); }));
  const auto faults = folder_ / "visited/state/virtual/faults.toml";
  put_bytes(faults, "[[fault]]\nkind = \"light-excursion\"\nshare = -0.2\n");
  protocol::ReferenceVisited bad;
  ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
    if (event.has_reference_visited()) bad = event.reference_visited();
    return event.has_reference_visited() && !bad.good() && !bad.what().empty();
  })) << rig.log();
  EXPECT_THAT(bad.what(), ContainsRegex("of their first radiance"));
  EXPECT_GE(bad.poses_again(), 1U);
  std::filesystem::remove(faults);
  EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  told_ = {"the reference patches have 0\\..* of their first radiance"};
  expect_told_of(rig);
  RunningRig calm(folder_ / "calm", tiny_rig_toml() + kVisits);
  ASSERT_NO_FATAL_FAILURE(calm.start());
  calm.submit(tiny_job(8));
  EXPECT_EQ(calm.await_job_end(), protocol::COMPLETE) << calm.log();
  EXPECT_EQ(calm.end(SIGTERM), 0);
  EXPECT_TRUE(frames_of(rig.scan()) == frames_of(calm.scan()));
}

// As after a machine was suspended: the call in flight has outlasted its bound.
TEST_F(Fault, AStepOfTheClockStopsTheRigAndLosesNothing) {
  cause("[[fault]]\nkind = \"clock-step\"\nby_s = 7200\nfrom_s = 910\ntimes = 1\n");
  begin();
  expect_stop("took longer than|no answer from");
  EXPECT_EQ(clear(), protocol::DONE);
  expect_nothing_lost();
}

// While rigd runs its time only goes on; what the machine's clock says counts at the next start. A new world
// begins with that clock, two hours behind the one of the night, which a step had brought forward.
TEST_F(Fault, AClockThatWasSetBackBetweenTwoStartsLosesNothing) {
  const auto state = folder_ / "visited/state/virtual";
  RunningRig rig(folder_ / "visited", tiny_rig_toml() + kVisits);
  std::filesystem::create_directories(state);
  put_bytes(state / "faults.toml", "[[fault]]\nkind = \"clock-step\"\nby_s = 7200\ntimes = 1\n");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  ASSERT_TRUE(rig.await([](const protocol::Event& event) { return event.has_stop_latched(); })) << rig.log();
  std::filesystem::remove(state / "faults.toml");
  protocol::Request clear_it;
  clear_it.mutable_clear_stop();
  rig.expect_done(clear_it);
  rig.submit(tiny_job(12));
  base::Time before{};
  int committed = 0;
  ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
    before = base::Time(std::chrono::microseconds(event.time_us()));
    return event.has_pose_committed() && ++committed == 4;
  })) << rig.log();
  EXPECT_EQ(rig.end(SIGKILL), -SIGKILL);
  std::filesystem::remove(state / "world.state");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  base::Time after{};
  ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
    after = base::Time(std::chrono::microseconds(event.time_us()));
    return event.has_reference_visited() && event.reference_visited().good();
  })) << rig.log();
  ASSERT_LT(after, before - std::chrono::hours(1));
  // What is taken now is not proven by the visits of a later hour.
  ASSERT_TRUE(rig.await([](const protocol::Event& event) { return event.has_pose_committed(); }));
  put_bytes(state / "faults.toml", "[[fault]]\nkind = \"light-excursion\"\nshare = -0.2\n");
  protocol::ReferenceVisited bad;
  ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
    if (event.has_reference_visited()) bad = event.reference_visited();
    return event.has_reference_visited() && !bad.good() && !bad.what().empty();
  })) << rig.log();
  EXPECT_GE(bad.poses_again(), 1U);
  std::filesystem::remove(state / "faults.toml");
  EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  const auto report = scan::verify_scan(rig.scan(), [](std::size_t) {});
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_TRUE(report->complete());
  EXPECT_THAT(bytes_in(rig.scan() / "report.txt"), ContainsRegex(kRestartedOnce));
}

// Nothing happens while rigd runs. The next start is ten minutes behind what the scan has, and the scan's
// times go on in their order.
TEST_F(Fault, AClockThatIsSetBackWhileRigdRunsIsNotNoticedAndLosesNothing) {
  const auto state = folder_ / "visited/state/virtual";
  RunningRig rig(folder_ / "visited", tiny_rig_toml() + kVisits);
  ASSERT_NO_FATAL_FAILURE(rig.start());
  rig.submit(tiny_job(12));
  base::Time latest{};
  int committed = 0;
  const auto goes_on = [&](int commits) {
    return rig.await([&](const protocol::Event& event) {
      const base::Time time{std::chrono::microseconds(event.time_us())};
      EXPECT_GE(time, latest) << event.ShortDebugString();
      latest = time;
      EXPECT_FALSE(event.has_stop_latched() || event.has_job_suspended()) << event.ShortDebugString();
      return event.has_pose_committed() && ++committed == commits;
    });
  };
  ASSERT_TRUE(goes_on(2)) << rig.log();
  put_bytes(state / "faults.new", "[[fault]]\nkind = \"clock-step\"\nby_s = -600\ntimes = 1\n");
  std::filesystem::rename(state / "faults.new", state / "faults.toml");
  ASSERT_TRUE(goes_on(6)) << rig.log();
  EXPECT_EQ(rig.end(SIGKILL), -SIGKILL);
  std::filesystem::remove(state / "faults.toml");
  ASSERT_NO_FATAL_FAILURE(rig.start());
  base::Time after{};
  ASSERT_TRUE(rig.await([&](const protocol::Event& event) {
    after = base::Time(std::chrono::microseconds(event.time_us()));
    return event.has_pose_committed();
  })) << rig.log();
  EXPECT_LT(after, latest - std::chrono::minutes(5));
  EXPECT_EQ(rig.await_job_end(), protocol::COMPLETE) << rig.log();
  EXPECT_EQ(rig.end(SIGTERM), 0) << rig.log();
  const auto journal = scan::Journal::open_read_only(scan::journal_path(rig.scan()));
  ASSERT_TRUE(journal.has_value());
  base::Time before{};
  const auto poses = journal->poses();
  const auto visits = journal->visits();
  ASSERT_TRUE(poses.has_value() && visits.has_value());
  for (const scan::PoseRecord& pose : *poses) {
    EXPECT_GT(pose.committed, before) << "row " << pose.row;
    before = pose.committed;
  }
  EXPECT_GT(visits->back().when, before) << "the last visit proves the last pose";
  const auto report = scan::verify_scan(rig.scan(), [](std::size_t) {});
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_THAT(report->problems, ::testing::IsEmpty());
  EXPECT_TRUE(report->complete());
  const std::string told = bytes_in(rig.scan() / "report.txt");
  EXPECT_THAT(told, ContainsRegex(kRestartedOnce));
  EXPECT_THAT(told, ContainsRegex("12 planned, 12 done \\(0 of them after retries\\)"));
}

TEST_F(Fault, AWrongFileOfFaultsIsComplainedAboutAndChangesNothing) {
  cause("[[fault]]\nkind = \"stal\"\n");
  begin();
  finish();
  EXPECT_THAT(rig_.log(), ContainsRegex("faults.toml:2:.*kind"));
  expect_undamaged(true);
}

}  // namespace
}  // namespace rig::test
