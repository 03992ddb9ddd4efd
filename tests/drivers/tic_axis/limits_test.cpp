// Limit switches, and homing on them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/tic_axis/axis_fixture.h"

namespace rig::drivers::tic {
namespace {

using base::ErrorCode;
using base::radians;
using sim::wire::TicWorld;
using std::chrono::milliseconds;

using TicLimits = test::TicAxisTest;

TEST_F(TicLimits, HomesOnEitherSwitch) {
  for (const bool forward : {false, true}) {
    test::LabTic lab;
    open(lab.table("arm", "", forward ? "homing = \"forward\"" : "homing = \"reverse\""));
    ASSERT_TRUE(axis().enable(true));
    ASSERT_TRUE(axis().home());
    EXPECT_FALSE(state().homed);
    EXPECT_TRUE(state().moving);
    ASSERT_TRUE(within(milliseconds(4000), [&] { return !state().moving; }));
    EXPECT_TRUE(state().homed);
    EXPECT_NEAR(lab.tic.motor_position(), forward ? 2500 : -2500, 1);
    EXPECT_EQ(lab.tic.position(), 0);
    EXPECT_NEAR(state().position_rad, radians(-62.5), 1e-9) << "count 0 is zero_deg";
    close();
  }
}

TEST_F(TicLimits, AReversedAxisHasItsSwitchesTheOtherWayRound) {
  test::LabTic lab;
  open(lab.table("arm", "reversed = true"));
  reference(lab.tic);
  lab.tic.press_limit(true, true);
  AxisState now = state();
  EXPECT_TRUE(now.at_low_limit);
  EXPECT_FALSE(now.at_high_limit);
  EXPECT_NEAR(now.position_rad, radians(-62.5 - 62.5), 1e-9);
  ASSERT_TRUE(axis().enable(true));
  // Smaller angles are greater counts: into the switch.
  const auto into = axis().move_to(radians(-130), radians(40), radians(400));
  ASSERT_FALSE(into);
  EXPECT_EQ(into.error().code, ErrorCode::refused);
  ASSERT_TRUE(axis().move_to(radians(-120), radians(40), radians(400)));
  EXPECT_TRUE(within(milliseconds(1000), [&] { return !state().moving; }));
  EXPECT_NEAR(lab.tic.motor_position(), -5 * 40, 1);
}

TEST_F(TicLimits, WhatALimitSwitchHeldUpDoesNotGoOn) {
  test::LabTic lab;
  open(lab.table());
  set_off(lab.tic);
  lab.tic.press_limit(true, true);
  EXPECT_TRUE(within(milliseconds(100), [&] { return lab.tic.velocity() == 0; }));
  const AxisState now = state();
  EXPECT_TRUE(now.at_high_limit);
  EXPECT_FALSE(now.moving);
  lab.tic.press_limit(true, false);  // it bounces
  EXPECT_TRUE(stands(lab.tic, milliseconds(300)));
  EXPECT_TRUE(state().homed);
}

TEST_F(TicLimits, WhereALimitSwitchMakesTheTicUncertainItIsHomedAgain) {
  TicWorld world;
  world.habits.limit_makes_uncertain = true;
  test::LabTic lab(world);
  open(lab.table());
  set_off(lab.tic);
  lab.tic.press_limit(true, true);
  EXPECT_TRUE(within(milliseconds(100), [&] { return lab.tic.velocity() == 0; }));
  EXPECT_FALSE(state().homed);
  EXPECT_EQ(axis().move_to(0, radians(40), radians(400)).error().code, ErrorCode::refused);
  ASSERT_TRUE(axis().home());
  lab.tic.press_limit(true, false);
  ASSERT_TRUE(within(milliseconds(4000), [&] { return !state().moving; }));
  EXPECT_TRUE(state().homed);
}

TEST_F(TicLimits, APlaceIsSetByHandOnlyOnItsSwitch) {
  test::LabTic lab;
  open(lab.table("arm", "", "homing = \"set_here\"\nhome_switch = \"forward\""));
  const auto off = axis().home();
  ASSERT_FALSE(off);
  EXPECT_EQ(off.error().code, ErrorCode::refused);
  lab.tic.put_motor(-2600);
  EXPECT_EQ(axis().home().error().code, ErrorCode::refused) << "the other switch";
  EXPECT_FALSE(state().homed);
  lab.tic.put_motor(2600);
  lab.tic.press_limit(false, true);
  EXPECT_EQ(axis().home().error().code, ErrorCode::device) << "both";
  lab.tic.press_limit(false, false);
  ASSERT_TRUE(axis().home());
  EXPECT_TRUE(state().homed);
  EXPECT_NEAR(state().position_rad, radians(-62.5), 1e-9);
  ASSERT_TRUE(axis().enable(true));
  EXPECT_TRUE(stands(lab.tic, milliseconds(200)));
  // And never of a motor that turns.
  ASSERT_TRUE(axis().move_to(radians(-100), radians(40), radians(400)));
  ASSERT_TRUE(within(milliseconds(500), [&] { return lab.tic.velocity() != 0; }));
  EXPECT_EQ(axis().home().error().code, ErrorCode::refused);
}

TEST_F(TicLimits, AnAxisWithoutHomingRefusesIt) {
  test::LabTic lab;
  open(lab.table("arm", "", "homing = \"none\""));
  ASSERT_TRUE(axis().enable(true));
  EXPECT_EQ(axis().home().error().code, ErrorCode::refused);
}

TEST_F(TicLimits, NotTheOtherWayRound) {
  test::LabTic lab;
  std::string text = lab.table("arm", "", "homing = \"none\"");
  text.replace(text.find("counts_per_deg = 40.0"), 21, "counts_per_deg = 10000000.0");
  text.replace(text.find("max_velocity_deg_s = 125.0"), 26, "max_velocity_deg_s = 0.005");
  text.replace(text.find("max_acceleration_deg_s2 = 500.0"), 31, "max_acceleration_deg_s2 = 0.5");
  open(text);
  command(lab.tic, 0xEC, -2'000'000'000);
  ASSERT_TRUE(axis().enable(true));
  const auto far = axis().move_to(radians(-62.5 + 200), radians(0.005), radians(0.5));
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().code, ErrorCode::bad_input);
  EXPECT_TRUE(stands(lab.tic, milliseconds(100)));
}

}  // namespace
}  // namespace rig::drivers::tic
