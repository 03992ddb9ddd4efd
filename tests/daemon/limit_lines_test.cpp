// Limit switches that are wired to inputs: an axis on one is treated as one whose drive says so itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "daemon/lines.h"
#include "daemon/safety.h"
#include "tests/daemon/rig_model.h"
#include "tests/daemon/small_setup.h"

namespace rig::daemon::testing {
namespace {

using base::degrees;
using base::radians;
using base::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::size_t kPan = 2;
constexpr double kNowhere_rad = 1e9;

daemon::Setup with_limit_lines() {
  daemon::Setup setup = small_setup();
  const machine::DeviceRef device{"virtual", "lines"};
  setup.rig.lines.limit[kPan] = {machine::LineRef{device, "pan_low"}, machine::LineRef{device, "pan_high"}};
  return setup;
}

protocol::Request move_pan(double to_deg) {
  protocol::Request request;
  auto& axis = *request.mutable_move()->add_axes();
  axis.set_axis("pan");
  axis.set_angle_deg(to_deg);
  return request;
}

protocol::Request jog_pan(double by_deg) {
  protocol::Request request;
  request.mutable_jog()->set_axis("pan");
  request.mutable_jog()->set_by_deg(by_deg);
  return request;
}

protocol::Request clear_request() {
  protocol::Request request;
  request.mutable_clear_stop();
  return request;
}

class LimitLines : public ::testing::Test {
 protected:
  explicit LimitLines(bool homed = true) : model_(with_limit_lines(), standing(homed, 1), 1) {}

  void run_until(const std::function<bool()>& done) {
    for (int i = 0; i < 200000 && !done(); ++i) model_.advance(model_.now() + seconds(1));
    ASSERT_TRUE(done());
    ASSERT_TRUE(model_.broken().empty()) << model_.broken().front();
  }
  void run_for(double duration_s) {
    const auto end = model_.now() + seconds(duration_s);
    while (model_.now() < end) model_.advance(end);
  }
  protocol::Reply ask(const protocol::Request& request) {
    const std::size_t before = model_.replies().size();
    model_.request(request);
    run_until([&] { return model_.replies().size() > before; });
    return model_.replies().back();
  }
  template <typename T>
  [[nodiscard]] std::size_t count() const {
    std::size_t found = 0;
    for (const Action& action : model_.history()) found += std::holds_alternative<T>(action) ? 1 : 0;
    return found;
  }
  [[nodiscard]] const drivers::AxisState& pan() const { return model_.state().axes[kPan].last; }
  [[nodiscard]] double pan_deg() const { return degrees(model_.place(kPan)); }
  void put_low_switch_at(double angle_deg) { model_.line_switch_rad[kPan][kLow] = radians(angle_deg); }
  void put_high_switch_at(double angle_deg) { model_.line_switch_rad[kPan][kHigh] = radians(angle_deg); }
  void mend() { model_.line_switch_rad[kPan] = {-kNowhere_rad, kNowhere_rad}; }

  RigModel model_;
};

class LimitLinesBeforeHoming : public LimitLines {
 protected:
  LimitLinesBeforeHoming() : LimitLines(false) {}
};

TEST_F(LimitLines, FurtherInIsRefusedAndOutIsAllowed) {
  put_low_switch_at(pan_deg() + 1);
  run_until([&] { return pan().at_low_limit; });
  const auto refused = ask(move_pan(pan_deg() - 5));
  EXPECT_EQ(refused.outcome(), protocol::REFUSED);
  EXPECT_THAT(refused.reason(), HasSubstr("axis pan stands on its low limit switch"));
  EXPECT_EQ(count<MoveAxis>(), 0U);
  const auto out = ask(move_pan(pan_deg() + 5));
  EXPECT_EQ(out.outcome(), protocol::DONE) << out.reason();
  EXPECT_EQ(model_.state().stopped, "");
  run_until([&] { return !pan().at_low_limit; });
}

TEST_F(LimitLinesBeforeHoming, FurtherInIsRefusedAndOutIsAllowed) {
  put_high_switch_at(pan_deg() - 1);
  run_until([&] { return pan().at_high_limit; });
  const auto refused = ask(jog_pan(1));
  EXPECT_EQ(refused.outcome(), protocol::REFUSED);
  EXPECT_THAT(refused.reason(), HasSubstr("axis pan stands on its high limit switch"));
  EXPECT_EQ(count<JogAxis>(), 0U);
  const auto out = ask(jog_pan(-3));
  EXPECT_EQ(out.outcome(), protocol::DONE) << out.reason();
}

TEST_F(LimitLines, AMoveThatRunsIntoOneIsStoppedWithinTwoLooks) {
  run_for(2);
  const double switch_deg = pan_deg() - 20;
  put_low_switch_at(switch_deg);
  const auto reply = ask(move_pan(pan_deg() - 60));
  EXPECT_EQ(reply.outcome(), protocol::FAILED);
  EXPECT_EQ(model_.state().stopped, "axis pan ran into its low limit switch");
  run_for(1);
  const double fastest_deg_s = degrees(with_limit_lines().rig.axes[kPan].max_velocity_rad_s);
  EXPECT_LT(pan_deg(), switch_deg);
  EXPECT_GT(pan_deg(), switch_deg - 2 * 0.05 * fastest_deg_s);
  // It is told as any stop is.
  bool latched = false;
  for (const auto& event : model_.events()) latched = latched || event.has_stop_latched();
  EXPECT_TRUE(latched);
  // And out it goes.
  EXPECT_EQ(ask(clear_request()).outcome(), protocol::DONE);
  run_for(2);
  EXPECT_EQ(ask(move_pan(pan_deg() - 5)).outcome(), protocol::REFUSED);
  const auto out = ask(move_pan(switch_deg + 5));
  EXPECT_EQ(out.outcome(), protocol::DONE) << out.reason();
}

TEST_F(LimitLinesBeforeHoming, AJogThatRunsIntoOneIsStopped) {
  run_for(2);
  put_high_switch_at(pan_deg() + 4);
  const auto reply = ask(jog_pan(9));
  EXPECT_EQ(reply.outcome(), protocol::FAILED);
  EXPECT_EQ(model_.state().stopped, "axis pan ran into its high limit switch");
}

// Even where the drive would tell of its own switch much later, or never.
TEST_F(LimitLines, TheDrivesOwnSwitchAndTheLineAreOneLimit) {
  model_.on_low_switch[kPan] = true;
  run_until([&] { return pan().at_low_limit; });
  run_for(2);
  EXPECT_TRUE(pan().at_low_limit) << "a line that is free does not free the drive's";
  put_high_switch_at(pan_deg() - 1);
  run_until([&] { return pan().at_high_limit; });
  run_for(2);
  EXPECT_TRUE(pan().at_low_limit && pan().at_high_limit) << "nor the other way round";
  model_.on_low_switch[kPan] = false;
  run_until([&] { return !pan().at_low_limit; });
  EXPECT_TRUE(pan().at_high_limit);
  mend();
  run_until([&] { return !pan().at_high_limit; });
}

// As with the drive's own switches: it may have to run onto one to find its reference. The arm's home is at
// 45 degrees, upwards from what a drive that is not homed counts as 0.
TEST_F(LimitLinesBeforeHoming, HomingIsTheDrivesAndNotStopped) {
  constexpr std::size_t kArm = 3;
  daemon::Setup setup = with_limit_lines();
  setup.rig.lines.limit[kArm] = {machine::LineRef{{"virtual", "lines"}, "arm_low"},
                                 machine::LineRef{{"virtual", "lines"}, "arm_high"}};
  model_ = RigModel(setup, standing(false, 1), 1);
  run_for(2);
  model_.line_switch_rad[kArm] = {kNowhere_rad, -kNowhere_rad};  // both pressed
  protocol::Request home;
  home.mutable_home()->add_axes("arm");
  const auto reply = ask(home);
  EXPECT_EQ(reply.outcome(), protocol::DONE) << reply.reason();
  EXPECT_EQ(model_.state().stopped, "");
  run_for(1);
  EXPECT_TRUE(model_.state().axes[kArm].last.at_high_limit) << "but it is seen";
}

TEST(LimitLinesAtTheStart, WhatWasNeverReadIsNotTakenForFree) {
  const daemon::Setup setup = with_limit_lines();
  const State state = standing(true, 1);
  const auto refused = limit_lines_known(setup, state);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().text(), HasSubstr("what the low limit line of axis pan says is not known"));
  JointAngles target{};
  target[kPan] = radians(20);
  EXPECT_FALSE(may_move(setup, state, {false, false, true, false}, target).has_value());
  State not_homed = standing(false, 1);
  EXPECT_FALSE(may_jog(setup, not_homed, kPan, radians(1)).has_value());
  EXPECT_TRUE(may_jog(small_setup(), not_homed, kPan, radians(1)).has_value()) << "none, none to know";
}

TEST_F(LimitLines, WhatWasReadTooLongAgoIsNotKnown) {
  run_for(2);
  State state = model_.state();
  EXPECT_TRUE(limit_lines_known(with_limit_lines(), state).has_value());
  state.now += seconds(2.1);
  EXPECT_FALSE(limit_lines_known(with_limit_lines(), state).has_value());
}

// Also where nothing is lost, but a reading failed: it is asked anew before anything moves.
TEST_F(LimitLines, WhatADeviceSaidBeforeItFailedIsNotKnown) {
  run_for(2);
  const auto known_after = [&](const std::string& device) {
    const Event failed{model_.now(), DeviceFailed{"it fails", device}};
    return limit_lines_known(with_limit_lines(), step(with_limit_lines(), model_.state(), failed).state)
        .has_value();
  };
  EXPECT_TRUE(known_after("light"));
  EXPECT_FALSE(known_after("lines"));
}

TEST_F(LimitLines, LinesThatAreLostStopWhatMovesUntilTheyAreBack) {
  run_for(2);
  model_.request(move_pan(pan_deg() + 60));
  run_until([&] { return count<MoveAxis>() > 0; });
  model_.gone = {"lines"};
  run_until([&] { return !model_.state().motion; });
  EXPECT_EQ(model_.state().stopped, "") << "it may come back by itself";
  EXPECT_GE(count<StopAxis>(), kAxisCount);
  EXPECT_EQ(model_.replies().back().outcome(), protocol::FAILED);
  run_for(2);
  const auto refused = ask(move_pan(pan_deg() + 5));
  EXPECT_EQ(refused.outcome(), protocol::REFUSED);
  EXPECT_THAT(refused.reason(), HasSubstr("lines: unplugged"));
  model_.gone.clear();
  run_for(2);
  const auto done = ask(move_pan(pan_deg() + 5));
  EXPECT_EQ(done.outcome(), protocol::DONE) << done.reason();
}

TEST_F(LimitLines, LinesThatAreLostSuspendTheJobWhichGoesOnWithThem) {
  JobEntry entry;
  entry.id = 1;
  model_.add_job(entry, small_job(4));
  run_until([&] { return model_.state().job && model_.state().job->committed == 1; });
  model_.gone = {"lines"};
  run_until([&] { return model_.state().job->suspended && model_.state().job->resting; });
  model_.gone.clear();
  run_until([&] { return model_.state().jobs[0].state == JobEntry::State::complete; });
  EXPECT_EQ(model_.state().jobs[0].retries, 0);
  EXPECT_EQ(model_.state().jobs[0].abandoned, 0);
}

TEST_F(LimitLines, AJobWaitsForTheFirstReading) {
  daemon::Setup setup = with_limit_lines();
  setup.rig.unattended.reference = some_reference();
  model_ = RigModel(setup, standing(true, 1), 1);
  model_.lines_silent = true;
  JobEntry entry;
  entry.id = 1;
  model_.add_job(entry, small_job(2));
  run_for(60);
  model_.lines_silent = false;
  run_until([&] { return model_.state().jobs[0].state == JobEntry::State::complete; });
  EXPECT_EQ(model_.state().jobs[0].retries, 0);
  for (const auto& event : model_.events()) {
    if (event.has_reference_visited()) {
      EXPECT_EQ(event.reference_visited().what(), "") << "a bad visit";
    }
  }
}

TEST_F(LimitLines, LinesThatSayNothingStopAMovingAxisWithinTheirBound) {
  run_for(2);
  model_.request(move_pan(pan_deg() - 80));
  run_until([&] { return count<MoveAxis>() > 0; });
  model_.lines_silent = true;
  const auto silent_since = model_.now();
  run_until([&] { return !model_.state().stopped.empty(); });
  EXPECT_EQ(model_.state().stopped, "the limit lines were not read for 1 s");
  EXPECT_LE(model_.now() - silent_since, seconds(1.001));
  EXPECT_GE(model_.now() - silent_since, seconds(0.9));
}

TEST_F(LimitLines, AnAxisWithoutLimitLinesWaitsForNone) {
  run_for(2);
  model_.lines_silent = true;
  protocol::Request request;
  auto& axis = *request.mutable_move()->add_axes();
  axis.set_axis("roll");
  axis.set_angle_deg(degrees(model_.place(0)) + 30);
  const std::size_t before = model_.history().size();
  model_.request(request);
  run_until([&] { return model_.state().motion.has_value(); });
  run_for(0.4);
  for (std::size_t i = before; i < model_.history().size(); ++i) {
    const auto* read = std::get_if<ReadLines>(&model_.history()[i]);
    EXPECT_FALSE(read != nullptr && read->limits_only);
  }
}

TEST_F(LimitLines, AreReadOftenWhileTheAxisMovesAndSeldomAtRest) {
  run_for(2);
  const std::size_t begin = count<ReadLines>();
  run_for(10);
  EXPECT_LE(count<ReadLines>() - begin, 21U) << "twice a second, as without limit lines";
  model_.request(move_pan(pan_deg() + 60));
  run_until([&] { return model_.state().motion.has_value(); });
  const std::size_t at_start = count<ReadLines>();
  run_for(0.5);
  ASSERT_TRUE(model_.state().motion.has_value());
  EXPECT_GE(count<ReadLines>() - at_start, 9U) << "every 50 ms";
  EXPECT_LE(count<ReadLines>() - at_start, 13U);
}

TEST(LimitLinesOfTwoDevices, EachIsKnownOrNotByItself) {
  daemon::Setup setup = with_limit_lines();
  setup.rig.lines.limit[0][kLow] = machine::LineRef{{"io", "lines"}, "roll_low"};
  State state = standing(true, 1);
  Actions actions;
  LinesRead read{"lines virtual/lines", state.now, {}, {}};
  read.limits[kPan] = {true, false};
  on_lines_read(setup, state, actions, read);
  EXPECT_TRUE(state.axes[kPan].last.at_low_limit);
  EXPECT_FALSE(state.limit_lines[0][kLow].known);
  EXPECT_FALSE(limit_lines_known(setup, state).has_value());
  LinesRead other{"lines io/lines", state.now, {}, {}};
  other.limits[0][kLow] = false;
  on_lines_read(setup, state, actions, other);
  EXPECT_TRUE(limit_lines_known(setup, state).has_value());
  forget_limit_lines(setup, state, "lines io/lines");
  EXPECT_FALSE(state.limit_lines[0][kLow].known);
  EXPECT_TRUE(state.limit_lines[kPan][kLow].known);
  EXPECT_THAT(actions, IsEmpty());
}

}  // namespace
}  // namespace rig::daemon::testing
