// Moving, stopping, and what each error of a Tic looks like.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/tic_axis/axis_fixture.h"

namespace rig::drivers::tic {
namespace {

using base::ErrorCode;
using base::radians;
using sim::wire::TicWorld;
using std::chrono::milliseconds;
using test::log_text;
using testing::HasSubstr;

using TicAxis = test::TicAxisTest;

TEST_F(TicAxis, IsEnabledAfterSafeStartAndNotBefore) {
  test::LabTic lab;
  open(lab.table());
  EXPECT_FALSE(state().enabled);
  EXPECT_EQ(state().fault, "") << "having to be resumed is no fault";
  EXPECT_FALSE(state().homed);
  ASSERT_TRUE(axis().enable(true));
  EXPECT_TRUE(state().enabled);
  EXPECT_TRUE(lab.tic.energized());
  ASSERT_TRUE(axis().enable(false));
  EXPECT_FALSE(state().enabled);
  EXPECT_EQ(state().fault, "");
  EXPECT_FALSE(lab.tic.energized());
}

TEST_F(TicAxis, SpeedsAndAccelerationsAreSentInItsUnits) {
  test::LabTic lab;
  open(lab.table());
  reference(lab.tic);
  ASSERT_TRUE(axis().enable(true));
  ASSERT_TRUE(axis().move_to(radians(10), radians(30), radians(200)));
  EXPECT_EQ(variable32(lab.tic, 0x16), 30U * 40 * 10000);
  EXPECT_EQ(variable32(lab.tic, 0x1E), 200U * 40 * 100);
  EXPECT_EQ(variable32(lab.tic, 0x1A), 200U * 40 * 100) << "it brakes as it accelerates";
  EXPECT_EQ(variable32(lab.tic, 0x0A), 2500U + 10 * 40);
  EXPECT_TRUE(axis().stop());
}

TEST_F(TicAxis, CapabilitiesAreWhatTheTicSays) {
  auto settings = test::lab_settings();
  settings[0x5F] = settings[0x60] = 0;
  test::LabTic without({}, settings);
  open(without.table("arm", "", "homing = \"none\""));
  EXPECT_FALSE(axis().capabilities().has_limit_switches);
  close();
  test::LabTic with;
  open(with.table());
  const AxisCapabilities can = axis().capabilities();
  EXPECT_TRUE(can.has_limit_switches);
  EXPECT_FALSE(can.keeps_position_unpowered);
  EXPECT_NEAR(can.resolution_rad, radians(1.0 / 40), 1e-12);
  EXPECT_NEAR(can.max_velocity_rad_s, radians(125), 1e-12);
  ASSERT_TRUE(can.homing_velocity_rad_s.has_value());
  EXPECT_NEAR(*can.homing_velocity_rad_s, radians(5000.0 / 40), 1e-12);
}

TEST_F(TicAxis, AHaltCostsTheReferenceOfWhatMoved) {
  test::LabTic lab;
  open(lab.table());
  set_off(lab.tic);
  ASSERT_TRUE(axis().stop());
  EXPECT_EQ(lab.tic.velocity(), 0) << "at once";
  EXPECT_FALSE(state().homed);
  EXPECT_TRUE(state().enabled) << "it holds";
}

TEST_F(TicAxis, AGentleStopKeepsIt) {
  test::LabTic lab;
  open(lab.table("arm", "stop = \"decelerate\""));
  set_off(lab.tic);
  const double at = lab.tic.motor_position();
  ASSERT_TRUE(axis().stop());
  EXPECT_TRUE(within(milliseconds(400), [&] { return lab.tic.velocity() == 0; }));
  // From 1600 microsteps/s with 16000/s^2: 80 microsteps, and what passed before the command.
  EXPECT_NEAR(lab.tic.motor_position(), at + 80, 60);
  EXPECT_TRUE(state().homed);
  EXPECT_TRUE(stands(lab.tic, milliseconds(200)));
}

TEST_F(TicAxis, AHomingThatDoesNotHeedAHaltIsCutOff) {
  TicWorld world;
  world.habits.halt_ends_homing = false;
  for (const char* stop : {"stop = \"halt\"", "stop = \"decelerate\""}) {
    test::LabTic lab(world);
    open(lab.table("arm", stop));
    ASSERT_TRUE(axis().enable(true));
    ASSERT_TRUE(axis().home());
    ASSERT_TRUE(within(milliseconds(500), [&] { return lab.tic.velocity() < -1000; }));
    ASSERT_TRUE(axis().stop());
    EXPECT_EQ(lab.tic.velocity(), 0);
    EXPECT_FALSE(lab.tic.energized());
    EXPECT_FALSE(state().homed);
    EXPECT_THAT(log_text(), HasSubstr("it is de-energised"));
    close();
  }
}

TEST_F(TicAxis, AKillSwitchStopsAndIsAcknowledged) {
  test::LabTic lab;
  open(lab.table());
  set_off(lab.tic);
  lab.tic.press_kill_switch(true);
  EXPECT_TRUE(within(milliseconds(500), [&] { return lab.tic.velocity() == 0; }));
  EXPECT_THAT(state().fault, HasSubstr("kill switch active"));
  const auto enabled = axis().enable(true);
  ASSERT_FALSE(enabled);
  EXPECT_EQ(enabled.error().code, ErrorCode::device);
  EXPECT_THAT(enabled.error().what, HasSubstr("kill switch active"));
  const auto moved = axis().move_to(0, radians(40), radians(400));
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::device);
  std::this_thread::sleep_for(milliseconds(10));  // the Tic looks at its errors again
  EXPECT_THAT(state().fault, HasSubstr("kill switch active"));
  lab.tic.press_kill_switch(false);
  EXPECT_TRUE(within(milliseconds(100), [&] { return (lab.tic.error_status() & 0x08U) == 0; }));
  EXPECT_THAT(state().fault, HasSubstr("it was stopped by: kill switch active")) << "over, and not yet known";
  EXPECT_TRUE(stands(lab.tic, milliseconds(200))) << "safe start keeps it from going on";
  ASSERT_TRUE(axis().enable(true));
  EXPECT_TRUE(stands(lab.tic, milliseconds(300)));
  EXPECT_EQ(state().fault, "");
  EXPECT_TRUE(state().homed);
}

TEST_F(TicAxis, LowVoltageIsToldInVolts) {
  test::LabTic lab;
  open(lab.table("arm", "min_vin_v = 11.0"));
  set_off(lab.tic);
  lab.tic.set_vin_mv(10500);
  EXPECT_EQ(state().fault, "its supply is 10.5 V, min_vin_v is 11");
  lab.tic.set_vin_mv(3200);
  EXPECT_TRUE(within(milliseconds(100), [&] { return lab.tic.velocity() == 0; }));
  const AxisState now = state();
  EXPECT_THAT(now.fault, HasSubstr("low VIN (3.2 V)"));
  EXPECT_FALSE(now.enabled);
  EXPECT_FALSE(now.homed) << "without current nothing holds it";
  lab.tic.set_vin_mv(12000);
  ASSERT_TRUE(axis().enable(true));
  EXPECT_EQ(state().fault, "");
}

TEST_F(TicAxis, AnotherTicsErrorIsTold) {
  test::LabTic lab;
  open(lab.table());
  ASSERT_TRUE(axis().enable(true));
  lab.tic.set_err_line(true);
  EXPECT_TRUE(within(milliseconds(200), [&] { return !state().fault.empty(); }));
  EXPECT_THAT(state().fault, HasSubstr("ERR line high"));
}

}  // namespace
}  // namespace rig::drivers::tic
