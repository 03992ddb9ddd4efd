// The unit's reset, and what takes the reference away again.
#include <gmock/gmock.h>

#include "tests/drivers/ptu_axis/unit_fixture.h"

namespace rig::drivers::ptu {
namespace {

using base::ErrorCode;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class PtuHoming : public testing::UnitTest {
 protected:
  // It hears nothing for the second that a reset of one axis takes.
  static Ptu::Setup deaf() {
    Ptu::Setup setup;
    setup.halt_ends_reset = false;
    setup.reset_speed = 12000;
    return setup;
  }
};

TEST_F(PtuHoming, ARefusalBeforeIt) {
  start();
  open();
  ASSERT_TRUE(pan().enable(true).has_value());
  const auto moved = go(pan(), 10);
  ASSERT_FALSE(moved.has_value());
  EXPECT_EQ(moved.error().code, ErrorCode::refused);
  EXPECT_THAT(moved.error().text(), HasSubstr("home it first"));
}

TEST_F(PtuHoming, NeitherBlocksNorLosesTheUnit) {
  start(deaf());
  open();
  ASSERT_TRUE(pan().enable(true).has_value());
  ASSERT_TRUE(pan().home().has_value());
  int looks = 0;
  base::Duration longest{};
  ASSERT_TRUE(wait_until([&] {
    for (Axis* each : {&pan(), &tilt()}) {
      const auto began = std::chrono::steady_clock::now();
      const AxisState now = state(*each);
      longest = std::max<base::Duration>(longest, std::chrono::steady_clock::now() - began);
      EXPECT_TRUE(now.moving || now.homed);
    }
    ++looks;
    return state(pan()).homed && !state(pan()).moving;
  }));
  EXPECT_GT(looks, 20);
  EXPECT_LT(longest, base::seconds(0.5));
  EXPECT_EQ(state(pan()).position_rad, 0);
  EXPECT_EQ(times_heard("R"), 1U);
}

TEST_F(PtuHoming, OneResetServesBothAxes) {
  start();
  open();
  make_ready(pan());
  EXPECT_TRUE(state(tilt()).homed);
  make_ready(tilt());
  EXPECT_EQ(times_heard("R"), 1U);
  // But whoever asks again gets one.
  make_ready(tilt());
  EXPECT_EQ(times_heard("R"), 2U);
  // And an axis that has moved since.
  ASSERT_TRUE(go(pan(), 1).has_value());
  ASSERT_TRUE(wait_until_still(pan()));
  make_ready(pan());
  EXPECT_EQ(times_heard("R"), 3U);
}

TEST_F(PtuHoming, AModeThatSaysWhatIsReset) {
  start();
  open(std::string("reset = \"mode\"\n") + testing::kBothAxes);
  make_ready(tilt());
  EXPECT_EQ(times_heard("RT"), 1U);
  EXPECT_EQ(times_heard("R"), 1U);
  EXPECT_FALSE(state(pan()).homed);
  make_ready(pan());
  EXPECT_EQ(times_heard("RP"), 1U);
  EXPECT_TRUE(state(tilt()).homed);
}

TEST_F(PtuHoming, OneAxisAtOnce) {
  Ptu::Setup setup;
  setup.one_axis_at_once = true;
  start(setup);
  open(std::string("reset = \"axis\"\n") + testing::kBothAxes);
  make_ready(pan());
  EXPECT_THAT(unit_->heard(), Not(Contains("R")));
  EXPECT_FALSE(state(tilt()).homed);
}

TEST_F(PtuHoming, FindsWhereItStandsAndHowFarItMayGo) {
  Ptu::Setup setup;
  setup.axes[Ptu::pan].stands_at = 700;
  start(setup);
  open();
  EXPECT_EQ(state(pan()).position_rad, 0);  // its counter begins anew wherever it stands
  make_ready(pan());
  EXPECT_EQ(unit_->position(Ptu::pan), 0);
  ASSERT_TRUE(go(pan(), 158).has_value());
  ASSERT_TRUE(wait_until_still(pan()));
  const auto beyond = go(pan(), 160);
  EXPECT_EQ(beyond.error().code, ErrorCode::refused);
  EXPECT_THAT(beyond.error().text(), HasSubstr("158.9"));
}

TEST_F(PtuHoming, OneThatFailsIsAFault) {
  start();
  open();
  unit_->fail_next_reset();
  ASSERT_TRUE(pan().enable(true).has_value());
  ASSERT_TRUE(pan().home().has_value());
  ASSERT_TRUE(wait_until([&] { return !state(pan()).fault.empty(); }));
  const AxisState now = state(pan());
  EXPECT_THAT(now.fault, HasSubstr("Axis error"));
  EXPECT_FALSE(now.homed);
  EXPECT_FALSE(go(pan(), 5).has_value());
  ASSERT_TRUE(pan().enable(true).has_value());
  EXPECT_EQ(state(pan()).fault, "");
  make_ready(pan());
}

TEST_F(PtuHoming, OneThatNeverEndsLosesTheUnit) {
  Ptu::Setup setup = deaf();
  setup.reset_speed = 1000;
  start(setup);
  open(std::string("reset_s = 1\n") + testing::kBothAxes);
  ASSERT_TRUE(pan().enable(true).has_value());
  ASSERT_TRUE(pan().home().has_value());
  base::Error said;
  EXPECT_TRUE(wait_until([&] {
    const auto now = pan().state();
    if (!now) said = now.error();
    return !now;
  }));
  EXPECT_EQ(said.code, ErrorCode::lost);
  EXPECT_THAT(said.text(), HasSubstr("within 1 s"));
}

TEST_F(PtuHoming, AStopThatEndsIt) {
  start();
  open();
  ASSERT_TRUE(pan().enable(true).has_value());
  ASSERT_TRUE(pan().home().has_value());
  ASSERT_TRUE(wait_until([&] { return unit_->position(Ptu::tilt) < -100; }));
  ASSERT_TRUE(pan().stop().has_value());
  ASSERT_TRUE(wait_until_still(pan()));
  ASSERT_TRUE(wait_until_still(tilt()));
  EXPECT_FALSE(unit_->moving(Ptu::tilt));
  EXPECT_FALSE(state(pan()).homed);
  EXPECT_FALSE(state(tilt()).homed);
  make_ready(pan());
}

TEST_F(PtuHoming, AStopThatAUnitDoesNotHear) {
  start(deaf());
  open();
  ASSERT_TRUE(pan().enable(true).has_value());
  ASSERT_TRUE(pan().home().has_value());
  ASSERT_TRUE(wait_until([&] { return unit_->position(Ptu::tilt) < -100; }));
  ASSERT_TRUE(pan().stop().has_value());
  // It goes on, and that is said; when it has ended nobody takes it for homed, who had it stopped.
  EXPECT_TRUE(state(pan()).moving);
  EXPECT_TRUE(unit_->moving(Ptu::pan));
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_FALSE(unit_->moving(Ptu::pan));
  EXPECT_FALSE(state(pan()).homed);
  EXPECT_GE(unit_->halts(Ptu::pan), 1);
  // Late answers are not taken for those to what is asked now.
  make_ready(pan());
  ASSERT_TRUE(go(pan(), -33).has_value());
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_NEAR(state(pan()).position_rad, base::radians(-33), base::radians(0.03));
}

TEST_F(PtuHoming, NothingElseMeanwhile) {
  start(deaf());
  open();
  ASSERT_TRUE(pan().enable(true).has_value());
  ASSERT_TRUE(pan().home().has_value());
  EXPECT_EQ(go(pan(), 3).error().code, ErrorCode::busy);
  EXPECT_EQ(tilt().home().error().code, ErrorCode::busy);
  EXPECT_EQ(tilt().enable(true).error().code, ErrorCode::busy);
  EXPECT_TRUE(wait_until_homed(pan()));
}

TEST_F(PtuHoming, IsVoidWithoutHoldingPower) {
  start();
  open();
  make_ready(pan());
  ASSERT_TRUE(pan().enable(false).has_value());
  EXPECT_EQ(times_heard("PHO"), 1U);
  const AxisState now = state(pan());
  EXPECT_FALSE(now.enabled);
  EXPECT_FALSE(now.homed);
  EXPECT_EQ(pan().home().error().code, ErrorCode::refused);
}

// However the unit shows that it was without power.
struct Trace {
  const char* name;
  const char* banner;
  bool keeps_modes;
};

class PtuPowerCycle : public testing::UnitTest, public ::testing::WithParamInterface<Trace> {};

TEST_P(PtuPowerCycle, IsNoticed) {
  Ptu::Setup setup;
  setup.banner = GetParam().banner;
  start(setup);
  open();
  make_ready(pan());
  ASSERT_TRUE(go(pan(), 50).has_value());
  ASSERT_TRUE(wait_until_still(pan()));
  if (GetParam().keeps_modes) {
    // As if somebody had saved the modes that it was set to.
    unit_->save_modes();
  }
  unit_->power_cycle();
  ASSERT_TRUE(wait_until([&] {
    const auto now = pan().state();
    return now && !now->homed;
  }));
  EXPECT_EQ(go(pan(), 3).error().code, ErrorCode::refused);
  make_ready(pan());
  ASSERT_TRUE(go(pan(), 3).has_value());
  ASSERT_TRUE(wait_until_still(pan()));
  EXPECT_EQ(unit_->position(Ptu::pan), std::round(3 * testing::kStepsPerDegree));
}

INSTANTIATE_TEST_SUITE_P(
    Traces, PtuPowerCycle,
    ::testing::Values(Trace{"BannerAndModes", "\r\n### PAN-TILT CONTROLLER\r\nInitializing...*\r\n", false},
                      Trace{"ModesAlone", "", false},
                      Trace{"BannerAlone",
                            "Pan-Tilt Controller v1.9.7r0, (C)1998 Directed Perception, Inc.\r\n", true}),
    [](const auto& each) { return each.param.name; });

}  // namespace
}  // namespace rig::drivers::ptu
