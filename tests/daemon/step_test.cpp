// What step() does in situations that are set up on purpose.
#include <gtest/gtest.h>
#include <limits>

#include "core/base/units.h"
#include "core/machine/motion.h"
#include "daemon/motion.h"
#include "tests/daemon/rig_model.h"
#include "tests/daemon/small_setup.h"

namespace rig::daemon::testing {
namespace {

using base::seconds;

class StepTest : public ::testing::Test {
 protected:
  RigModel model_{small_setup(), standing(true, 0), 1};

  void run_until(const std::function<bool()>& done) {
    for (int i = 0; i < 200000 && !done(); ++i) model_.advance(model_.now() + seconds(1));
    ASSERT_TRUE(done());
    ASSERT_TRUE(model_.broken().empty()) << model_.broken().front();
  }
  void run_for(double duration_s) {
    const auto end = model_.now() + seconds(duration_s);
    while (model_.now() < end) model_.advance(end);
  }
  const protocol::Reply& ask(const protocol::Request& request,
                             protocol::Role role = protocol::Role::operator_) {
    const std::size_t before = model_.replies().size();
    model_.request(request, role);
    run_until([&] { return model_.replies().size() > before; });
    return model_.replies().back();
  }
  template <typename T>
  std::vector<T> actions(std::size_t from = 0) const {
    std::vector<T> found;
    for (std::size_t i = from; i < model_.history().size(); ++i) {
      if (const auto* action = std::get_if<T>(&model_.history()[i])) found.push_back(*action);
    }
    return found;
  }
  void start_job(const machine::JobConfig& config) {
    JobEntry entry;
    entry.id = 1;
    model_.add_job(entry, config);
  }
  [[nodiscard]] JobEntry::State job_state() const { return model_.state().jobs.at(0).state; }
};

protocol::Request move_request(const std::string& axis, double angle_deg) {
  protocol::Request request;
  auto& named = *request.mutable_move()->add_axes();
  named.set_axis(axis);
  named.set_angle_deg(angle_deg);
  return request;
}

protocol::Request stop_request(const std::string& reason) {
  protocol::Request request;
  request.mutable_stop()->set_reason(reason);
  return request;
}

protocol::Request clear_request() {
  protocol::Request request;
  request.mutable_clear_stop();
  return request;
}

TEST_F(StepTest, HomesOneAxisAfterTheOtherInTheOrderOfTheRig) {
  protocol::Request request;
  request.mutable_home();
  EXPECT_EQ(ask(request).outcome(), protocol::DONE);
  const auto homed = actions<HomeAxis>();
  const auto order = small_setup().rig.home_order;
  ASSERT_EQ(homed.size(), kAxisCount);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    EXPECT_EQ(homed[i].axis, order[i]);
    EXPECT_NEAR(model_.state().axes[i].last.position_rad, small_setup().rig.axes[i].home_rad, 1e-9);
  }
}

TEST_F(StepTest, ClearingAStopAcknowledgesTheFaultThatADriveKeeps) {
  model_.latched_fault[2] = "overload";
  run_until([&] { return !model_.state().stopped.empty(); });
  EXPECT_EQ(model_.state().stopped, "axis pan: overload");
  const std::size_t before = model_.history().size();
  EXPECT_EQ(ask(clear_request()).outcome(), protocol::DONE);
  run_until([&] { return model_.state().axes[2].known; });
  EXPECT_EQ(model_.state().stopped, "");
  const auto enabled = actions<EnableAxis>(before);
  ASSERT_EQ(enabled.size(), 1U) << "the axes that had no fault are left alone";
  EXPECT_EQ(enabled[0].axis, 2U);
  EXPECT_EQ(ask(move_request("pan", 25)).outcome(), protocol::DONE);
}

TEST_F(StepTest, MovesAndProvesIt) {
  EXPECT_EQ(ask(move_request("pan", 25)).outcome(), protocol::DONE);
  EXPECT_NEAR(model_.state().axes[2].last.position_rad, base::radians(25), 1e-9);
}

TEST_F(StepTest, ApproachesFromBelow) {
  EXPECT_EQ(ask(move_request("pan", -40)).outcome(), protocol::DONE);
  const auto moves = actions<MoveAxis>();
  ASSERT_EQ(moves.size(), 2U);
  EXPECT_NEAR(moves[0].target_rad, base::radians(-42), 1e-9);
  EXPECT_NEAR(moves[1].target_rad, base::radians(-40), 1e-9);
}

TEST_F(StepTest, TellsWhereAMoveEndedElsewhere) {
  model_.faults.off_target = 1;
  const auto& reply = ask(move_request("pan", 25));
  EXPECT_EQ(reply.outcome(), protocol::FAILED);
  EXPECT_NE(reply.reason().find("pan stands at"), std::string::npos) << reply.reason();
}

TEST_F(StepTest, RefusesWhatIsNotAllowed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& request : {move_request("pan", 91), move_request("pan", -1e9), move_request("pan", nan),
                              move_request("elbow", 1), clear_request()}) {
    const auto& reply = ask(request);
    EXPECT_EQ(reply.outcome(), protocol::REFUSED) << request.ShortDebugString();
    EXPECT_FALSE(reply.reason().empty());
  }
  EXPECT_TRUE(actions<MoveAxis>().empty());
}

protocol::Request jog_request(const std::string& axis, double by_deg) {
  protocol::Request request;
  request.mutable_jog()->set_axis(axis);
  request.mutable_jog()->set_by_deg(by_deg);
  return request;
}

// A drive that homes more slowly than the reduced speed is not stopped for it.
TEST(Homing, MayTakeTheTimeOfTheSlowerOfBothSpeeds) {
  constexpr std::size_t kPanAxis = 2;
  daemon::Setup setup = small_setup();
  const machine::AxisConfig& pan = setup.rig.axes[kPanAxis];
  const auto over_its_travel_s = [&](double velocity_rad_s) {
    return machine::travel_time_s(pan.max_rad - pan.min_rad, velocity_rad_s, pan.max_acceleration_rad_s2);
  };
  EXPECT_DOUBLE_EQ(homing_time_s(setup, kPanAxis), over_its_travel_s(pan.jog_velocity_rad_s));
  setup.homing_velocity_rad_s[kPanAxis] = pan.jog_velocity_rad_s / 4;
  EXPECT_DOUBLE_EQ(homing_time_s(setup, kPanAxis), over_its_travel_s(pan.jog_velocity_rad_s / 4));
  setup.homing_velocity_rad_s[kPanAxis] = pan.jog_velocity_rad_s * 4;
  EXPECT_DOUBLE_EQ(homing_time_s(setup, kPanAxis), over_its_travel_s(pan.jog_velocity_rad_s));
}

// Before homing. Pan stands at 12 degrees by its own count.
class JogTest : public StepTest {
 protected:
  void SetUp() override { model_ = RigModel(small_setup(), standing(false, 0), 1); }
  static constexpr std::size_t kPan = 2;
  [[nodiscard]] double pan_deg() const { return base::degrees(model_.state().axes[kPan].last.position_rad); }
};

TEST_F(JogTest, MovesAnAxisThatIsNotHomedByALittleAtItsReducedSpeed) {
  const double before_deg = pan_deg();
  const auto& reply = ask(jog_request("pan", -2));
  EXPECT_EQ(reply.outcome(), protocol::DONE) << reply.reason();
  EXPECT_NEAR(pan_deg(), before_deg - 2, 1e-6);
  EXPECT_FALSE(model_.state().axes[kPan].last.homed);
  EXPECT_TRUE(model_.state().axes[kPan].last.enabled);
  const auto jogs = actions<JogAxis>();
  ASSERT_EQ(jogs.size(), 1U);
  EXPECT_EQ(jogs[0].velocity_rad_s, small_setup().rig.axes[kPan].jog_velocity_rad_s);
  EXPECT_TRUE(actions<MoveAxis>().empty());
}

TEST_F(JogTest, RefusesWhatGoesTooFarOrMakesNoSense) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& request : {jog_request("pan", 10.01), jog_request("pan", -10.01), jog_request("pan", nan),
                              jog_request("elbow", 1), move_request("pan", 12)}) {
    const auto& reply = ask(request);
    EXPECT_EQ(reply.outcome(), protocol::REFUSED) << request.ShortDebugString();
    EXPECT_FALSE(reply.reason().empty());
  }
  EXPECT_TRUE(actions<JogAxis>().empty());
  EXPECT_TRUE(actions<EnableAxis>().empty());
}

TEST_F(JogTest, GoesOutOfALimitSwitchAndNotFurtherIn) {
  model_.on_low_switch[kPan] = true;
  run_until([&] { return model_.state().axes[kPan].last.at_low_limit; });
  const auto& reply = ask(jog_request("pan", -1));
  EXPECT_EQ(reply.outcome(), protocol::REFUSED);
  EXPECT_NE(reply.reason().find("low limit switch"), std::string::npos) << reply.reason();
  EXPECT_TRUE(actions<JogAxis>().empty());
  EXPECT_EQ(ask(jog_request("pan", 1)).outcome(), protocol::DONE);
}

TEST_F(JogTest, StopsWhereItRunsIntoALimitSwitch) {
  model_.request(jog_request("pan", 5));
  run_until([&] { return !actions<JogAxis>().empty(); });
  model_.on_high_switch[kPan] = true;
  run_until([&] { return !model_.state().stopped.empty(); });
  EXPECT_EQ(model_.state().stopped, "axis pan ran into its high limit switch");
  EXPECT_EQ(model_.replies().back().outcome(), protocol::FAILED);
}

TEST_F(JogTest, IsFollowedAndStoppedWhereItDoesNotGo) {
  model_.faults.stuck = 1;
  const auto& reply = ask(jog_request("pan", 5));
  EXPECT_EQ(reply.outcome(), protocol::FAILED);
  EXPECT_NE(model_.state().stopped.find("pan did not end in time"), std::string::npos)
      << model_.state().stopped;
}

TEST_F(JogTest, ADriverThatCannotIsNoFault) {
  model_.refuses_jogs = true;
  const auto& reply = ask(jog_request("pan", 2));
  EXPECT_EQ(reply.outcome(), protocol::REFUSED);
  EXPECT_NE(reply.reason().find("this drive cannot"), std::string::npos) << reply.reason();
  EXPECT_EQ(model_.state().stopped, "");
  EXPECT_FALSE(model_.state().motion.has_value());
}

TEST_F(JogTest, NothingMovesWhileTheStopIsLatched) {
  EXPECT_EQ(ask(stop_request("somebody came in")).outcome(), protocol::DONE);
  EXPECT_EQ(ask(jog_request("pan", 2)).outcome(), protocol::REFUSED);
  EXPECT_TRUE(actions<JogAxis>().empty());
}

TEST_F(JogTest, AStopEndsIt) {
  model_.request(jog_request("pan", 9));
  run_until([&] { return model_.state().axes[kPan].last.moving; });
  EXPECT_EQ(ask(stop_request("somebody came in")).outcome(), protocol::DONE);
  run_until([&] { return model_.state().axes[kPan].known; });
  EXPECT_LT(pan_deg(), base::degrees(some_poses()[0][kPan]) + 9 - 0.5);
}

protocol::Request snap_request(double exposure_us) {
  protocol::Request request;
  request.mutable_snap()->set_exposure_us(exposure_us);
  return request;
}

TEST_F(StepTest, ADamagedFrameIsTakenAgainAndCountsAsAnAttempt) {
  start_job(small_job(2));
  run_until([&] { return !actions<TriggerCamera>().empty(); });
  model_.faults.damaged = 1;
  run_until([&] { return !actions<RecordFailure>().empty(); });
  model_.faults.damaged = 0;
  run_until([&] { return job_state() == JobEntry::State::complete; });
  const auto failures = actions<RecordFailure>();
  EXPECT_EQ(failures[0].reason, "a frame: part of it never came");
  EXPECT_FALSE(failures[0].abandon);
  EXPECT_EQ(model_.plan(1)[0].attempts, 1);
  EXPECT_EQ(model_.state().jobs.at(0).done, 2);
  EXPECT_EQ(model_.state().stopped, "") << "the night goes on";
}

TEST_F(StepTest, ACameraWhoseFramesAreAllDamagedIsAtFault) {
  model_.faults.damaged = 1;
  start_job(small_job(5));
  run_until([&] { return !model_.state().stopped.empty(); });
  EXPECT_NE(model_.state().stopped.find("5 frames one after the other were no good"), std::string::npos)
      << model_.state().stopped;
  EXPECT_NE(model_.state().stopped.find("part of it never came"), std::string::npos);
}

TEST_F(StepTest, ADamagedFrameOfAnExposureThatWasStoppedIsNothing) {
  model_.request(snap_request(1e6));
  run_until([&] { return !actions<TriggerCamera>().empty(); });
  const auto exposure = actions<TriggerCamera>().back().exposure;
  EXPECT_EQ(ask(stop_request("somebody came in")).outcome(), protocol::DONE);
  model_.post(FrameDamaged{exposure, "part of it never came"});
  run_for(2);
  EXPECT_EQ(model_.state().frames_refused, 0);
}

TEST_F(StepTest, ABusyCameraIsTriggeredAgainUntilItTakesTheTrigger) {
  // Shorter than the deadline of a call: nothing was exposed before that could explain more.
  EXPECT_EQ(ask(snap_request(1e4)).outcome(), protocol::DONE);
  model_.busy_until = model_.now() + seconds(1);
  start_job(small_job(2));
  run_until([&] { return job_state() == JobEntry::State::complete; });
  EXPECT_EQ(model_.state().stopped, "");
  EXPECT_TRUE(actions<RecordFailure>().empty()) << "no frame was lost by it";
}

TEST_F(StepTest, ACameraMayBeBusyAsLongAsTheExposureThatWasEnded) {
  EXPECT_EQ(ask(snap_request(1e4)).outcome(), protocol::DONE);
  model_.request(snap_request(2e6));
  run_until([&] { return model_.state().frame && model_.state().frame->exposing; });
  // It goes on to its end, and is read out: longer than a call's deadline.
  model_.busy_until = model_.now() + seconds(2 + 0.5);
  EXPECT_EQ(ask(stop_request("somebody came in")).outcome(), protocol::DONE);
  run_until([&] { return model_.state().axes[0].known; });
  EXPECT_EQ(ask(clear_request()).outcome(), protocol::DONE);
  const auto& reply = ask(snap_request(1e4));
  EXPECT_EQ(reply.outcome(), protocol::DONE) << reply.reason();
}

TEST_F(StepTest, ACameraThatStaysBusyIsAtFault) {
  EXPECT_EQ(ask(snap_request(1e4)).outcome(), protocol::DONE);
  run_for(5);
  const base::Time asked = model_.now();
  model_.busy_until = model_.now() + seconds(3600);
  EXPECT_EQ(ask(snap_request(1e4)).outcome(), protocol::FAILED);
  EXPECT_EQ(model_.state().stopped, "the camera takes no trigger: it exposes");
  const double took_s = base::to_seconds(model_.now() - asked);
  const double bound_s = small_setup().rig.deadlines.camera_s;
  EXPECT_GE(took_s, bound_s);
  EXPECT_LE(took_s, bound_s + 0.2);
}

TEST_F(StepTest, AJogOfAHomedAxisIsAMoveLikeAnyOther) {
  EXPECT_EQ(ask(jog_request("pan", 5)).outcome(), protocol::DONE);
  EXPECT_TRUE(actions<JogAxis>().empty());
  const auto moves = actions<MoveAxis>();
  ASSERT_FALSE(moves.empty());
  EXPECT_NEAR(moves.back().target_rad, some_poses()[0][2] + base::radians(5), 1e-9);
  EXPECT_EQ(ask(jog_request("pan", 1000)).outcome(), protocol::REFUSED) << "its limits hold";
}

TEST_F(StepTest, AnObserverMayLookAndStopOnly) {
  protocol::Request home;
  home.mutable_home();
  protocol::Request snap;
  snap.mutable_snap()->set_exposure_us(1000);
  protocol::Request light;
  light.mutable_set_light()->set_on(true);
  protocol::Request submit;
  submit.mutable_submit_job();
  protocol::Request abort;
  abort.mutable_abort_job()->set_job(1);
  for (const auto& request : {home, snap, light, submit, abort, move_request("pan", 1), clear_request()}) {
    EXPECT_EQ(ask(request, protocol::Role::observer).outcome(), protocol::REFUSED)
        << request.ShortDebugString();
  }
  protocol::Request status;
  status.mutable_get_status();
  EXPECT_EQ(ask(status, protocol::Role::observer).outcome(), protocol::DONE);
  EXPECT_EQ(ask(stop_request("look out"), protocol::Role::observer).outcome(), protocol::DONE);
  EXPECT_EQ(model_.state().stopped, "look out");
}

TEST_F(StepTest, AMoveThatNeverEndsStopsTheRig) {
  model_.faults.stuck = 1;
  const auto& reply = ask(move_request("pan", 25));
  EXPECT_EQ(reply.outcome(), protocol::FAILED);
  EXPECT_NE(model_.state().stopped.find("did not end in time"), std::string::npos) << model_.state().stopped;
  // 37 degrees at 60 deg/s take 1.1 s; half as long again and two seconds, and a poll.
  EXPECT_LT(model_.now(), standing(true, 0).now + seconds(4.5));
}

TEST_F(StepTest, AnAxisThatDoesNotAnswerStopsTheRig) {
  model_.faults.lost = 1;
  const auto& reply = ask(move_request("pan", 25));
  EXPECT_EQ(reply.outcome(), protocol::FAILED);
  EXPECT_NE(model_.state().stopped.find("no answer from axis pan"), std::string::npos);
}

TEST_F(StepTest, ACameraThatDoesNotAnswerStopsTheRig) {
  protocol::Request snap;
  snap.mutable_snap()->set_exposure_us(1000);
  model_.faults.lost = 1;
  EXPECT_EQ(ask(snap).outcome(), protocol::FAILED);
  EXPECT_EQ(model_.state().stopped, "the camera does not answer");
}

TEST_F(StepTest, AfterAStopInMotionThePositionHasToBeReadFirst) {
  model_.request(move_request("pan", 80));
  run_until([&] { return model_.state().motion.has_value(); });
  run_for(0.4);
  EXPECT_EQ(ask(stop_request("")).outcome(), protocol::DONE);
  EXPECT_EQ(model_.replies()[model_.replies().size() - 2].outcome(), protocol::FAILED);  // the move
  EXPECT_EQ(ask(clear_request()).outcome(), protocol::DONE);
  const auto& reply = ask(move_request("tilt", 0));
  EXPECT_EQ(reply.outcome(), protocol::REFUSED);
  EXPECT_NE(reply.reason().find("not known"), std::string::npos) << reply.reason();
  run_for(1.5);
  EXPECT_EQ(ask(move_request("tilt", 0)).outcome(), protocol::DONE);
}

TEST_F(StepTest, AStopDropsAMoveThatWaitsForItsTurn) {
  model_.faults.late_s = 5;
  model_.request(move_request("pan", 80));
  model_.request(stop_request(""));
  run_until([&] { return model_.replies().size() == 2; });
  run_for(20);
  EXPECT_NEAR(model_.state().axes[2].last.position_rad, some_poses()[0][2], 1e-12);
  EXPECT_TRUE(model_.broken().empty());
}

TEST_F(StepTest, AFrameOfAStoppedExposureIsNotTakenForTheNext) {
  protocol::Request snap;
  snap.mutable_snap()->set_exposure_us(1000);
  model_.request(snap);
  run_until([&] { return model_.state().frame && model_.state().frame->fetching; });
  const std::uint64_t first = model_.state().frame->exposure;
  model_.request(stop_request(""));
  model_.request(clear_request());
  model_.request(snap);
  run_until([&] { return model_.state().frame && model_.state().frame->exposure != first; });
  const State waiting = model_.state();
  const Step late = step(small_setup(), waiting, {waiting.now, FrameFetched{first, {7}, {}, 0}});
  ASSERT_TRUE(late.state.frame.has_value());
  ASSERT_FALSE(late.actions.empty());
  EXPECT_EQ(std::get<ReleaseFrame>(late.actions[0]).slot.index, 7);
}

TEST_F(StepTest, TheEmergencyStopLatchesUntilItIsReleasedAndCleared) {
  model_.emergency_stop = true;
  run_until([&] { return !model_.state().stopped.empty(); });
  EXPECT_EQ(ask(clear_request()).outcome(), protocol::REFUSED);
  protocol::Request home;
  home.mutable_home();
  EXPECT_EQ(ask(home).outcome(), protocol::REFUSED);
  model_.emergency_stop = false;
  run_until([&] { return !model_.state().emergency_stop; });
  EXPECT_EQ(ask(home).outcome(), protocol::REFUSED);
  EXPECT_EQ(ask(clear_request()).outcome(), protocol::DONE);
  EXPECT_EQ(ask(home).outcome(), protocol::DONE);
}

TEST_F(StepTest, AJobHomesWarmsUpAndTakesEveryPose) {
  RigModel cold(small_setup(), standing(false, 0), 3);
  JobEntry entry;
  entry.id = 1;
  cold.add_job(entry, small_job(5));
  for (int i = 0; i < 100000 && cold.state().jobs[0].state != JobEntry::State::complete; ++i) {
    cold.advance(cold.now() + seconds(1));
  }
  EXPECT_EQ(cold.state().jobs[0].done, 5);
  EXPECT_EQ(cold.state().jobs[0].abandoned, 0);
  cold.check_at_rest();
  EXPECT_TRUE(cold.broken().empty()) << cold.broken().front();
}

// Whether the move to the second pose began before the last frame of the first was there.
bool left_before_the_last_frame(const machine::ExposureConfig& exposure) {
  RigModel model(small_setup(), standing(true, 0), 4);
  machine::JobConfig job = small_job(2);
  job.exposure = exposure;
  JobEntry entry;
  entry.id = 1;
  model.add_job(entry, job);
  for (int i = 0; i < 100000 && model.state().jobs[0].state != JobEntry::State::complete; ++i) {
    model.advance(model.now() + seconds(1));
  }
  EXPECT_TRUE(model.broken().empty()) << model.broken().front();
  EXPECT_EQ(model.state().jobs[0].done, 2);
  bool left = false;
  std::size_t first_row = 0;
  std::size_t seen = 0;
  for (const auto& event : model.events()) {
    if (event.has_frame_taken() && event.frame_taken().row() == 0) ++first_row;
  }
  for (const auto& event : model.events()) {
    if (event.has_pose_started() && event.pose_started().row() == 1) left = seen < first_row;
    if (event.has_frame_taken() && event.frame_taken().row() == 0) ++seen;
  }
  return left;
}

TEST(Overlap, TheRigLeavesWhenItIsKnownThatNoExposureFollows) {
  machine::ExposureConfig exposure;
  exposure.exposures_s = {0.16, 0.02};
  EXPECT_TRUE(left_before_the_last_frame(exposure));
  exposure = {};
  exposure.strategy = machine::ExposureStrategy::predicted;
  exposure.lightest_s = {0.02, 0.001};
  exposure.darkest_s = {0.5, 0.02};
  exposure.darkest_rad = base::radians(80);
  EXPECT_TRUE(left_before_the_last_frame(exposure));
  exposure = {};
  exposure.strategy = machine::ExposureStrategy::adaptive;
  exposure.first_s = 0.01;
  exposure.longest_s = 0.5;
  exposure.most_frames = 9;
  exposure.snr = 1;
  exposure.short_share = 0.9;
  EXPECT_FALSE(left_before_the_last_frame(exposure)) << "it has to see that this frame is enough";
  exposure.most_frames = 1;
  EXPECT_TRUE(left_before_the_last_frame(exposure)) << "whatever it shows, it is the last";
}

TEST_F(StepTest, APoseOutOfToleranceIsTriedAgainAndThenAbandoned) {
  start_job(small_job(2));
  model_.faults.off_target = 1;
  run_until([&] { return job_state() == JobEntry::State::complete; });
  model_.advance(model_.now());
  EXPECT_EQ(model_.state().jobs[0].abandoned, 2);
  EXPECT_EQ(model_.state().jobs[0].retries, 4);
  EXPECT_TRUE(actions<TriggerCamera>().empty());
  run_for(1);
  for (const auto& row : model_.plan(1)) {
    EXPECT_EQ(row.attempts, 3);
    EXPECT_NE(row.reason.find("stands at"), std::string::npos) << row.reason;
  }
}

TEST_F(StepTest, ARetrySucceedsAfterAWhile) {
  start_job(small_job(1));
  model_.faults.off_target = 1;
  run_until([&] { return model_.state().jobs[0].retries == 1; });
  model_.faults.off_target = 0;
  const auto failed = model_.now();
  run_until([&] { return job_state() == JobEntry::State::complete; });
  EXPECT_EQ(model_.state().jobs[0].done, 1);
  EXPECT_GT(model_.now(), failed + seconds(1));  // the delay of the job's retry
}

TEST_F(StepTest, AJobGoesOnAfterAStopWithThePoseItWasAt) {
  start_job(small_job(3));
  run_until([&] { return model_.state().jobs[0].done == 1 && model_.state().frame; });
  EXPECT_EQ(ask(stop_request("")).outcome(), protocol::DONE);
  EXPECT_EQ(job_state(), JobEntry::State::active);
  run_for(5);
  EXPECT_EQ(ask(clear_request()).outcome(), protocol::DONE);
  run_until([&] { return job_state() == JobEntry::State::complete; });
  EXPECT_EQ(model_.state().jobs[0].done, 3);
  EXPECT_EQ(model_.state().jobs[0].abandoned, 0);
}

TEST_F(StepTest, ADriveThatLosesItsReferenceIsHomedAgain) {
  start_job(small_job(3));
  run_until([&] { return model_.state().jobs[0].done == 1; });
  model_.lose_reference(1);
  run_until([&] { return job_state() == JobEntry::State::complete; });
  EXPECT_EQ(model_.state().jobs[0].done, 3);
  const auto homed = actions<HomeAxis>();
  ASSERT_EQ(homed.size(), 1U);
  EXPECT_EQ(homed[0].axis, 1U);
}

TEST_F(StepTest, EveryExposureStartsInTheLight) {
  daemon::Setup setup = small_setup();
  setup.light.has_shutter = false;
  RigModel bare(setup, standing(true, 0), 5);
  JobEntry entry;
  entry.id = 1;
  bare.add_job(entry, small_job(2));
  for (int i = 0; i < 100000 && bare.state().jobs[0].state != JobEntry::State::complete; ++i) {
    bare.advance(bare.now() + seconds(1));
  }
  EXPECT_EQ(bare.state().jobs[0].done, 2);
  EXPECT_TRUE(bare.broken().empty()) << bare.broken().front();
}

TEST_F(StepTest, AStoppedRigStaysDark) {
  daemon::Setup setup = small_setup();
  setup.light.has_shutter = false;
  RigModel bare(setup, standing(true, 0), 5);
  bare.request(stop_request(""));
  protocol::Request light;
  light.mutable_set_light()->set_level(0.7);
  bare.request(light);
  while (bare.replies().size() < 2) bare.advance(bare.now() + seconds(1));
  EXPECT_EQ(bare.replies()[1].outcome(), protocol::REFUSED);
  EXPECT_TRUE(bare.broken().empty());
}

TEST_F(StepTest, EndingAnswersWhoWaitsAndLeavesTheRigSafe) {
  model_.request(move_request("pan", 80));
  run_until([&] { return model_.state().motion.has_value(); });
  model_.post(EndRequested{});
  run_until([&] { return model_.state().ending; });
  ASSERT_EQ(model_.replies().size(), 1U);
  EXPECT_EQ(model_.replies()[0].outcome(), protocol::FAILED);
  EXPECT_EQ(actions<StopAxis>().size(), kAxisCount);
  ASSERT_EQ(actions<SetShutter>().size(), 1U);
  EXPECT_FALSE(actions<SetShutter>()[0].open);
}

TEST_F(StepTest, StopsOnAReadingThatIsNoNumber) {
  drivers::AxisState garbage;
  garbage.position_rad = std::numeric_limits<double>::quiet_NaN();
  garbage.homed = true;
  const Step next = step(small_setup(), standing(true, 0),
                         {standing(true, 0).now, AxisPolled{2, standing(true, 0).last_poll + 1, garbage}});
  EXPECT_NE(next.state.stopped.find("pan reports no position"), std::string::npos);
  EXPECT_FALSE(next.state.axes[2].known);
}

}  // namespace
}  // namespace rig::daemon::testing
