// The axes of the module against simulated Tics: what each fault looks like, and that nothing moves that
// should not.
#include "drivers/tic_axis/axis.h"

#include <csignal>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mutex>

#include "core/base/units.h"
#include "drivers/tic_axis/devices.h"
#include "tests/drivers/tic_axis/lab.h"

namespace rig::drivers::tic {
namespace {

using base::ErrorCode;
using base::radians;
using sim::wire::SetupPacket;
using sim::wire::TicHabits;
using sim::wire::TicWorld;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// The module's log of the test that runs.
std::mutex log_mutex;
std::string logged;
void keep_log(base::LogLevel /*level*/, std::string_view text) {
  const std::lock_guard lock(log_mutex);
  logged += std::string(text) + "\n";
}
std::string log_text() {
  const std::lock_guard lock(log_mutex);
  return logged;
}

class TicAxisTest : public testing::Test {
 protected:
  TicAxisTest() {
    const std::lock_guard lock(log_mutex);
    logged.clear();
  }

  // Opens the module on this rig.toml; the axes by their order in it.
  void open(const std::string& text) {
    const auto table = base::ConfigTable::parse(text, "rig.toml");
    ASSERT_TRUE(table.has_value()) << table.error().text();
    auto opened = open_devices({"tic", *table, "/nonexistent", *clock_, &keep_log});
    ASSERT_TRUE(opened.has_value()) << opened.error().text();
    devices_ = std::move(*opened);
  }
  Axis& axis(std::size_t i = 0) { return *std::get<std::unique_ptr<Axis>>(devices_.at(i).is); }
  void close() { devices_.clear(); }

  AxisState state(std::size_t i = 0) {
    const auto now = axis(i).state();
    EXPECT_TRUE(now.has_value()) << now.error().text();
    return now.value_or(AxisState{});
  }
  // As if it had been homed on its reverse switch and driven back: count 0 is at the switch.
  static void reference(sim::wire::Tic& tic) { command(tic, 0xEC, 2500); }
  static void command(sim::wire::Tic& tic, std::uint8_t request, std::int32_t value) {
    const auto bits = static_cast<std::uint32_t>(value);
    const auto answer = tic.control({0x40, request, static_cast<std::uint16_t>(bits & 0xFFFFU),
                                     static_cast<std::uint16_t>(bits >> 16U), 0},
                                    {});
    EXPECT_EQ(answer.kind, sim::wire::ControlAnswer::Kind::done);
  }
  static std::uint32_t variable32(sim::wire::Tic& tic, std::uint16_t offset) {
    const auto answer = tic.control({0xC0, 0xA1, 0, offset, 4}, {});
    EXPECT_EQ(answer.data.size(), 4U);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value |= static_cast<std::uint32_t>(answer.data.at(i)) << (8 * i);
    return value;
  }

  template <typename Condition>
  static bool within(milliseconds bound, Condition&& condition) {
    const auto deadline = Steady::now() + bound;
    while (!condition()) {
      if (Steady::now() >= deadline) return false;
      std::this_thread::sleep_for(milliseconds(2));
    }
    return true;
  }
  // Referenced, enabled, and on its way from 0 to 40 degrees at 40 degrees/s, which takes a second.
  void set_off(sim::wire::Tic& tic) {
    reference(tic);
    ASSERT_TRUE(axis().enable(true));
    ASSERT_TRUE(axis().move_to(radians(40), radians(40), radians(400)));
    ASSERT_TRUE(within(milliseconds(500), [&] { return tic.motor_position() > 100; }));
  }
  static bool stands(sim::wire::Tic& tic, milliseconds how_long) {
    const double from = tic.motor_position();
    return !within(how_long, [&] { return tic.velocity() != 0 || tic.motor_position() != from; });
  }

  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  std::vector<Device> devices_;
};

TEST_F(TicAxisTest, IsEnabledAfterSafeStartAndNotBefore) {
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

TEST_F(TicAxisTest, SpeedsAndAccelerationsAreSentInItsUnits) {
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

// --- the command timeout

// Fed while calls come; once none come for `silence_ms` the Tic brakes within silence, a quarter of its
// timeout and its timeout, although this process is well.
TEST_F(TicAxisTest, StopsByItselfWhenRigdIsSilent) {
  auto settings = test::lab_settings();
  settings[0x09] = 200, settings[0x0A] = 0;  // command timeout: 200 ms
  test::LabTic lab({}, settings);
  open("silence_ms = 1000\n" + lab.table());
  reference(lab.tic);
  ASSERT_TRUE(axis().enable(true));
  ASSERT_TRUE(axis().move_to(radians(60), radians(10), radians(400)));
  const auto busy_until = Steady::now() + milliseconds(1500);
  while (Steady::now() < busy_until) {
    ASSERT_TRUE(state().moving);
    std::this_thread::sleep_for(milliseconds(100));
  }
  const auto last_call = Steady::now();
  ASSERT_EQ(lab.tic.error_status(), 0) << "seven times its command timeout have passed";
  EXPECT_TRUE(within(milliseconds(3000), [&] { return lab.tic.velocity() == 0; }));
  const auto stood_after = Steady::now() - last_call;
  EXPECT_GE(stood_after, milliseconds(1000)) << "as long as silence lasts it goes on";
  EXPECT_LE(stood_after, milliseconds(1000 + 50 + 200 + 400)) << "braking takes 25 ms";
  EXPECT_THAT(log_text(), HasSubstr("no call for"));
  // Told until the next command, and forgiven by it.
  EXPECT_THAT(state().fault, HasSubstr("command timeout"));
  EXPECT_TRUE(within(milliseconds(500), [&] { return log_text().find("fed again") != std::string::npos; }));
  EXPECT_THAT(state().fault, HasSubstr("command timeout"));
  ASSERT_TRUE(axis().stop());
  const AxisState after = state();
  EXPECT_EQ(after.fault, "");
  EXPECT_FALSE(after.enabled);
  EXPECT_FALSE(after.moving);
  EXPECT_TRUE(after.homed) << "it braked, and counted";
  ASSERT_TRUE(axis().enable(true));
  EXPECT_TRUE(stands(lab.tic, milliseconds(300))) << "the old target is forgotten";
}

TEST_F(TicAxisTest, ATimeoutWhileItStandsIsNoFault) {
  auto settings = test::lab_settings();
  settings[0x09] = 100, settings[0x0A] = 0;
  test::LabTic lab({}, settings);
  open("silence_ms = 1000\n" + lab.table());
  reference(lab.tic);
  ASSERT_TRUE(axis().enable(true));
  EXPECT_EQ(state().fault, "");
  ASSERT_TRUE(within(milliseconds(2000), [&] { return (lab.tic.error_status() & 0x40U) != 0; }));
  EXPECT_EQ(state().fault, "");
  EXPECT_FALSE(state().enabled);
  // Nor is it taken for what stops the next move.
  ASSERT_TRUE(axis().enable(true));
  ASSERT_TRUE(axis().move_to(radians(1), radians(40), radians(400)));
  EXPECT_EQ(state().fault, "");
}

// The rigd of the next test, in a process of its own.
TEST_F(TicAxisTest, DISABLED_MovesUntilItIsKilled) {
  open(std::getenv("RIG_TEST_TABLE"));
  ASSERT_TRUE(axis().enable(true));
  ASSERT_TRUE(axis().move_to(radians(60), radians(10), radians(400)));
  while (true) (void)axis().state();
}

pid_t start_the_other(const std::string& table) {
  const std::string filter = "--gtest_filter=TicAxisTest.DISABLED_MovesUntilItIsKilled";
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::setenv("RIG_TEST_TABLE", table.c_str(), 1);
  ::execl("/proc/self/exe", "test", filter.c_str(), "--gtest_also_run_disabled_tests", nullptr);
  ::_exit(127);
}

TEST_F(TicAxisTest, StopsWithinItsTimeoutWhenTheProcessDies) {
  test::LabTic lab;
  reference(lab.tic);
  const std::string text = lab.table();
  const pid_t child = start_the_other(text);
  ASSERT_GT(child, 0);
  ASSERT_TRUE(within(milliseconds(10000), [&] { return lab.tic.velocity() > 300; }));
  std::this_thread::sleep_for(milliseconds(1200));
  ASSERT_GT(lab.tic.velocity(), 300) << "fed for longer than its timeout";
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  const auto died = Steady::now();
  EXPECT_TRUE(within(milliseconds(3000), [&] { return lab.tic.velocity() == 0; }));
  EXPECT_LE(Steady::now() - died, milliseconds(1000 + 500)) << "its command timeout, and braking";
  EXPECT_LT(lab.tic.motor_position(), 60 * 40 - 100);
  // The next one finds it at rest, with its reference, and says what had been.
  open(text);
  EXPECT_THAT(log_text(), HasSubstr("before now: command timeout"));
  EXPECT_TRUE(state().homed);
  EXPECT_EQ(state().fault, "");
  EXPECT_TRUE(stands(lab.tic, milliseconds(200)));
}

// --- errors

TEST_F(TicAxisTest, AKillSwitchStopsAndIsAcknowledged) {
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

TEST_F(TicAxisTest, LowVoltageIsToldInVolts) {
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

TEST_F(TicAxisTest, AnotherTicsErrorIsTold) {
  test::LabTic lab;
  open(lab.table());
  ASSERT_TRUE(axis().enable(true));
  lab.tic.set_err_line(true);
  EXPECT_TRUE(within(milliseconds(200), [&] { return !state().fault.empty(); }));
  EXPECT_THAT(state().fault, HasSubstr("ERR line high"));
}

// --- stops

TEST_F(TicAxisTest, AHaltCostsTheReferenceOfWhatMoved) {
  test::LabTic lab;
  open(lab.table());
  set_off(lab.tic);
  ASSERT_TRUE(axis().stop());
  EXPECT_EQ(lab.tic.velocity(), 0) << "at once";
  EXPECT_FALSE(state().homed);
  EXPECT_TRUE(state().enabled) << "it holds";
}

TEST_F(TicAxisTest, AGentleStopKeepsIt) {
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

TEST_F(TicAxisTest, AHomingThatDoesNotHeedAHaltIsCutOff) {
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

// --- limits and homing

TEST_F(TicAxisTest, HomesOnEitherSwitch) {
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

TEST_F(TicAxisTest, AReversedAxisHasItsSwitchesTheOtherWayRound) {
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

TEST_F(TicAxisTest, WhatALimitSwitchHeldUpDoesNotGoOn) {
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

TEST_F(TicAxisTest, WhereALimitSwitchMakesTheTicUncertainItIsHomedAgain) {
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

TEST_F(TicAxisTest, APlaceIsSetByHandOnlyOnItsSwitch) {
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

TEST_F(TicAxisTest, AnAxisWithoutHomingRefusesIt) {
  test::LabTic lab;
  open(lab.table("arm", "", "homing = \"none\""));
  ASSERT_TRUE(axis().enable(true));
  EXPECT_EQ(axis().home().error().code, ErrorCode::refused);
}

TEST_F(TicAxisTest, NotTheOtherWayRound) {
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

// --- settings

TEST_F(TicAxisTest, AMismatchIsAFaultThatSaysHowToMendItAndStopsStillWork) {
  auto settings = test::lab_settings();
  settings[0x41] = 0;
  test::LabTic lab({}, settings);
  open(lab.table());
  EXPECT_THAT(state().fault, HasSubstr("step_mode is 1 in the Tic, 8 in rig.toml"));
  EXPECT_THAT(state().fault, HasSubstr("ticcmd -d 00123456 --settings"));
  EXPECT_THAT(log_text(), HasSubstr("step_mode is 1 in the Tic"));
  EXPECT_EQ(axis().enable(true).error().code, ErrorCode::device);
  EXPECT_EQ(axis().home().error().code, ErrorCode::device);
  EXPECT_EQ(axis().move_to(0, 0.1, 1).error().code, ErrorCode::device);
  // Somebody else had set it going.
  command(lab.tic, 0x85, 0);
  command(lab.tic, 0x83, 0);
  command(lab.tic, 0xE3, 1'000'000);
  ASSERT_TRUE(within(milliseconds(500), [&] { return lab.tic.velocity() > 50; }));
  EXPECT_TRUE(state().moving);
  EXPECT_TRUE(axis().stop());
  EXPECT_EQ(lab.tic.velocity(), 0);
  EXPECT_EQ(lab.tic.setting_writes_seen(), 0) << "never silently";
  // Somebody mends it.
  lab.tic.set_settings(test::lab_settings());
  EXPECT_EQ(state().fault, "");
  EXPECT_TRUE(axis().enable(true));
  EXPECT_TRUE(state().enabled);
}

TEST_F(TicAxisTest, SettingsAreWrittenWhereThatIsAskedFor) {
  auto settings = test::lab_settings();
  settings[0x41] = 0;
  settings[0x40] = 6;
  test::LabTic lab({}, settings);
  const std::string text = "write_settings = true\n" + lab.table("arm", "command_timeout_ms = 700");
  open(text);
  EXPECT_EQ(state().fault, "");
  EXPECT_EQ(lab.tic.settings()[0x41], 3);
  EXPECT_EQ(lab.tic.settings()[0x40], 46);
  EXPECT_EQ(lab.tic.settings()[0x09] + 256 * lab.tic.settings()[0x0A], 700);
  EXPECT_THAT(log_text(), HasSubstr("written to it"));
  EXPECT_TRUE(axis().enable(true));
  const int writes = lab.tic.setting_writes_seen();
  EXPECT_EQ(writes, 4);
  close();
  open(text);
  EXPECT_EQ(state().fault, "");
  EXPECT_EQ(lab.tic.setting_writes_seen(), writes) << "its memory wears: only what differs";
}

TEST_F(TicAxisTest, NothingIsWrittenToATicThatTurns) {
  auto settings = test::lab_settings();
  settings[0x40] = 6;
  test::LabTic lab({}, settings);
  command(lab.tic, 0x85, 0);
  command(lab.tic, 0x83, 0);
  command(lab.tic, 0xE3, 10'000'000);
  ASSERT_TRUE(within(milliseconds(500), [&] { return lab.tic.velocity() > 100; }));
  open("write_settings = true\n" + lab.table());
  const auto now = axis().state();
  ASSERT_FALSE(now);
  EXPECT_EQ(now.error().code, ErrorCode::lost);
  EXPECT_THAT(now.error().what, HasSubstr("while the motor turns"));
  EXPECT_EQ(lab.tic.setting_writes_seen(), 0);
}

// In another control mode commands to move or to halt are ignored without a word.
TEST_F(TicAxisTest, ATicThatDoesNotObeyIsCutOff) {
  test::LabTic lab;
  open(lab.table());
  set_off(lab.tic);
  constexpr std::uint16_t kControlMode = 0x01, kEncoderPosition = 6;
  (void)lab.tic.control({0x40, 0x13, kEncoderPosition, kControlMode, 0}, {});
  EXPECT_TRUE(axis().stop());
  EXPECT_EQ(lab.tic.velocity(), 0);
  EXPECT_FALSE(lab.tic.energized());
  close();
  open(lab.table());
  EXPECT_THAT(state().fault, HasSubstr("control_mode: serial"));
}

// --- several, and coming and going

TEST_F(TicAxisTest, SeveralTicsAreBusesOfTheirOwn) {
  test::LabTic first;
  TicWorld world;
  world.serial = "00999999";
  test::LabTic second(world);
  second.serial = world.serial;
  open(first.table("arm") + second.table("pan"));
  ASSERT_EQ(devices_.size(), 2U);
  EXPECT_EQ(devices_[0].name, "arm");
  EXPECT_EQ(devices_[1].name, "pan");
  EXPECT_NE(devices_[0].bus, devices_[1].bus);
  ASSERT_TRUE(axis(0).enable(true));
  EXPECT_TRUE(first.tic.energized());
  EXPECT_FALSE(second.tic.energized());
  first.socket.cut();
  EXPECT_EQ(axis(0).state().error().code, ErrorCode::lost);
  EXPECT_FALSE(state(1).enabled);
  ASSERT_TRUE(axis(1).enable(true));
  EXPECT_TRUE(second.tic.energized());
}

TEST_F(TicAxisTest, ComesBackByItsSerialNumber) {
  test::LabTic lab;
  open(lab.table());
  set_off(lab.tic);
  lab.socket.cut();
  const auto lost = axis().state();
  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().code, ErrorCode::lost);
  EXPECT_TRUE(within(milliseconds(2000), [&] { return lab.tic.velocity() == 0; })) << "it stops by itself";
  lab.socket.restore();
  EXPECT_TRUE(within(milliseconds(2500), [&] { return axis().state().has_value(); }));
  const AxisState back = state();
  EXPECT_FALSE(back.enabled);
  EXPECT_FALSE(back.moving);
  EXPECT_TRUE(back.homed) << "it kept its power and counted";
  EXPECT_THAT(log_text(), HasSubstr("before now: command timeout"));
  ASSERT_TRUE(axis().enable(true));
  EXPECT_TRUE(stands(lab.tic, milliseconds(200)));
}

TEST_F(TicAxisTest, ATicWithAnotherNumberIsNotTakenForIt) {
  TicWorld world;
  world.serial = "00999999";
  test::LabTic other(world);
  open(other.table());  // asks for 00123456
  const auto now = axis().state();
  ASSERT_FALSE(now);
  EXPECT_EQ(now.error().code, ErrorCode::lost);
  EXPECT_THAT(now.error().text(), HasSubstr("00123456"));
  EXPECT_EQ(other.tic.feeds_seen(), 0);
}

TEST_F(TicAxisTest, CapabilitiesAreWhatTheTicSays) {
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

// There is no USB here, or no Tic on it; the transport says so in words.
TEST(TicUsb, SaysWhatIsNotThere) {
  const auto by_serial = open_transport({"no such serial", "", "usb"}, {});
  ASSERT_FALSE(by_serial);
  EXPECT_EQ(by_serial.error().code, ErrorCode::lost);
  EXPECT_THAT(by_serial.error().text(), testing::AnyOf(HasSubstr("no such serial"), HasSubstr("libusb")));
  const auto by_path = open_transport({"", "99-1", "usb"}, {});
  ASSERT_FALSE(by_path);
  EXPECT_THAT(by_path.error().text(), testing::AnyOf(HasSubstr("99-1"), HasSubstr("libusb")));
}

}  // namespace
}  // namespace rig::drivers::tic
