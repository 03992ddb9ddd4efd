// Moves, stops, end stops and what else a unit tells.
#include <gmock/gmock.h>

#include "tests/drivers/ptu_axis/unit_fixture.h"

namespace rig::drivers::ptu {
namespace {

using base::degrees;
using base::ErrorCode;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class PtuMoving : public testing::UnitTest {
 protected:
  void SetUp() override {
    start();
    open();
    make_ready(pan());
    unit_->forget_heard();
  }
};

TEST_F(PtuMoving, SaysSpeedAndTargetInWholeSteps) {
  // 12.3 deg are 239.17 steps, 30 deg/s are 583.3.
  ASSERT_TRUE(go(pan(), 12.3, 30, 240).has_value());
  EXPECT_THAT(unit_->heard(), ElementsAre("PS583", "PP239"));
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_EQ(unit_->position(Ptu::pan), 239);
  EXPECT_NEAR(degrees(state(pan()).position_rad), 239 / testing::kStepsPerDegree, 1e-9);
}

TEST_F(PtuMoving, NeverFasterThanItMay) {
  ASSERT_TRUE(go(pan(), 5, 500, 240).has_value());
  EXPECT_THAT(unit_->heard(), Contains("PS1166"));  // max_velocity_deg_s = 60
}

TEST_F(PtuMoving, NotAsSlowAsTheUnitCannotGo) {
  const auto moved = go(pan(), 5, 1, 240);
  ASSERT_FALSE(moved.has_value());
  EXPECT_EQ(moved.error().code, ErrorCode::bad_input);
  EXPECT_THAT(moved.error().text(), HasSubstr("lowest speed"));
}

TEST_F(PtuMoving, BothAxesAtATime) {
  make_ready(tilt());
  ASSERT_TRUE(go(pan(), 40).has_value());
  ASSERT_TRUE(go(tilt(), -20).has_value());
  EXPECT_TRUE(state(pan()).moving);
  EXPECT_TRUE(state(tilt()).moving);
  ASSERT_TRUE(wait_until_still(tilt()));
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_EQ(unit_->position(Ptu::pan), 778);
  EXPECT_EQ(unit_->position(Ptu::tilt), -389);
  EXPECT_NEAR(degrees(state(pan()).position_rad), 40, 0.03);
  EXPECT_NEAR(degrees(state(tilt()).position_rad), -20, 0.03);
}

TEST_F(PtuMoving, AStopHaltsOneAxis) {
  make_ready(tilt());
  ASSERT_TRUE(go(pan(), 100).has_value());
  ASSERT_TRUE(go(tilt(), -40).has_value());
  ASSERT_TRUE(wait_until([&] { return unit_->position(Ptu::pan) > 200; }));
  ASSERT_TRUE(pan().stop().has_value());
  EXPECT_EQ(unit_->halts(Ptu::pan) - unit_->halts(Ptu::tilt), 1);
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_FALSE(unit_->moving(Ptu::pan));
  EXPECT_TRUE(state(pan()).homed);
  EXPECT_NEAR(degrees(state(pan()).position_rad), unit_->position(Ptu::pan) / testing::kStepsPerDegree, 1e-6);
  ASSERT_TRUE(wait_until_still(tilt()));
  EXPECT_EQ(unit_->position(Ptu::tilt), -778);
}

// The unit says that it is done when it is, or before it falls silent.
class PtuTables : public PtuMoving, public ::testing::WithParamInterface<bool> {};

INSTANTIATE_TEST_SUITE_P(SaysDone, PtuTables, ::testing::Bool(),
                         [](const auto& each) { return each.param ? "Before" : "After"; });

TEST_P(PtuTables, AnotherAccelerationIsTakenOverFirst) {
  Ptu::Setup slow;
  slow.tables = std::chrono::milliseconds(600);
  slow.says_done_first = GetParam();
  start(slow);
  open();
  make_ready(pan());
  unit_->forget_heard();
  const auto began = clock_->now();
  ASSERT_TRUE(go(pan(), 30, 40, 100).has_value());
  // Short, although the unit takes its time; and it is under way until it has got there.
  EXPECT_LT(clock_->now() - began, base::seconds(0.4));
  EXPECT_TRUE(state(pan()).moving);
  EXPECT_EQ(tilt().enable(true).error().code, ErrorCode::busy);
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_EQ(unit_->position(Ptu::pan), 583);
  EXPECT_THAT(unit_->heard(), Contains("PA1944"));
  // The same one again costs nothing.
  unit_->forget_heard();
  ASSERT_TRUE(go(pan(), 0, 40, 100).has_value());
  EXPECT_EQ(times_heard("PA1944"), 0U);
  ASSERT_TRUE(wait_until([&] { return unit_->moving(Ptu::pan); }));
  const auto other = go(pan(), 3, 40, 50);
  EXPECT_EQ(other.error().code, ErrorCode::busy);
  EXPECT_THAT(other.error().text(), HasSubstr("max_acceleration_deg_s2"));
  ASSERT_TRUE(wait_until_still(pan()));
}

TEST_P(PtuTables, AStopBeforeItSetOut) {
  Ptu::Setup slow;
  slow.tables = std::chrono::milliseconds(400);
  slow.says_done_first = GetParam();
  start(slow);
  open();
  make_ready(pan());
  ASSERT_TRUE(go(pan(), 30, 40, 100).has_value());
  ASSERT_TRUE(pan().stop().has_value());
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_FALSE(wait_until([&] { return unit_->moving(Ptu::pan); }, 0.7));
  EXPECT_EQ(unit_->position(Ptu::pan), 0);
  EXPECT_TRUE(state(pan()).homed);
}

TEST_F(PtuMoving, AnEndStopOnTheWayEndsMoveAndReference) {
  ASSERT_TRUE(go(pan(), 100).has_value());
  ASSERT_TRUE(wait_until([&] { return unit_->position(Ptu::pan) > 200; }));
  unit_->press(Ptu::pan, true, true);
  ASSERT_TRUE(wait_until([&] { return state(pan()).at_high_limit; }));
  ASSERT_TRUE(wait_until_still(pan()));
  const AxisState now = state(pan());
  EXPECT_FALSE(now.homed);
  EXPECT_FALSE(now.at_low_limit);
  EXPECT_EQ(now.fault, "");
  EXPECT_EQ(go(pan(), 0).error().code, ErrorCode::refused);
  unit_->press(Ptu::pan, true, false);
  make_ready(pan());
  EXPECT_FALSE(state(pan()).at_high_limit);
}

TEST_F(PtuMoving, TheSideOfAnEndStopIsTheAxisOwn) {
  open(R"(
[axis.pan]
reversed = true
max_velocity_deg_s = 60.0
max_acceleration_deg_s2 = 240.0
)");
  make_ready(pan());
  ASSERT_TRUE(go(pan(), -100).has_value());
  ASSERT_TRUE(wait_until([&] { return unit_->position(Ptu::pan) > 200; }));
  unit_->press(Ptu::pan, true, true);
  ASSERT_TRUE(wait_until([&] { return state(pan()).at_low_limit; }));
  EXPECT_FALSE(state(pan()).at_high_limit);
}

TEST_F(PtuMoving, TellsItsTemperature) {
  EXPECT_NEAR(state(pan()).temperature_c.value_or(0), 30, 1e-9);
  // It is not asked at every look.
  for (int i = 0; i < 20; ++i) (void)state(pan());
  EXPECT_LE(times_heard("O"), 1U);
}

TEST_F(PtuMoving, HoldingPower) {
  EXPECT_EQ(times_heard("PHR"), 0U);
  ASSERT_TRUE(pan().enable(true).has_value());
  EXPECT_EQ(times_heard("PHR"), 1U);
  open(std::string("hold_power = \"low\"\n") + testing::kBothAxes);
  EXPECT_FALSE(state(pan()).enabled);
  ASSERT_TRUE(pan().enable(true).has_value());
  EXPECT_EQ(times_heard("PHL"), 1U);
  EXPECT_TRUE(state(pan()).enabled);
}

TEST_F(PtuMoving, AnAxisThatSomebodyElseMovesMoves) {
  // Another position than the one it rested at.
  unit_->nudge(Ptu::pan, 500);
  EXPECT_TRUE(state(pan()).moving);
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_EQ(unit_->position(Ptu::pan), 500);
  EXPECT_NEAR(degrees(state(pan()).position_rad), 500 / testing::kStepsPerDegree, 1e-6);
}

TEST_F(PtuMoving, RefusesNonsense) {
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    EXPECT_EQ(go(pan(), bad).error().code, ErrorCode::bad_input);
    EXPECT_EQ(go(pan(), 1, bad).error().code, ErrorCode::bad_input);
    EXPECT_EQ(go(pan(), 1, 1, bad).error().code, ErrorCode::bad_input);
  }
  EXPECT_EQ(go(pan(), 1, 0).error().code, ErrorCode::bad_input);
  EXPECT_EQ(go(pan(), 1, -3).error().code, ErrorCode::bad_input);
  EXPECT_TRUE(unit_->heard().empty());
}

}  // namespace
}  // namespace rig::drivers::ptu
