// The driver against drives on a line: what it writes to them, what it makes of what they say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "core/base/units.h"
#include "sim/wire/modbus_leadshine.h"
#include "sim/wire/modbus_line.h"
#include "sim/wire/modbus_oriental.h"
#include "tests/core/temporary_folder.h"
#include "tests/drivers/modbus_axis/opened_module.h"

namespace rig::drivers::modbus {
namespace {

using base::ErrorCode;
using base::radians;
using sim::wire::LeadshineDrive;
using sim::wire::ModbusLine;
using sim::wire::OrientalDrive;
using std::chrono::milliseconds;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kVelocity = 2, kAcceleration = 17;  // rad/s and rad/s^2: below the axes' own

AxisState state_of(Axis& axis) {
  const auto state = axis.state();
  EXPECT_TRUE(state.has_value()) << state.error().text();
  return state.value_or(AxisState{});
}

void done(const Result<void>& outcome, const char* what) {
  ASSERT_TRUE(outcome.has_value()) << what << ": " << outcome.error().text();
}

// Until the axis says that it stands.
AxisState at_rest(Axis& axis) {
  AxisState state;
  for (int i = 0; i < 1000; ++i) {
    state = state_of(axis);
    if (!state.moving) return state;
    std::this_thread::sleep_for(milliseconds(5));
  }
  ADD_FAILURE() << "it still moves";
  return state;
}

// Until a drive that was away answers.
bool comes_back(Axis& axis) {
  for (int i = 0; i < 300; ++i) {
    if (axis.state()) return true;
    std::this_thread::sleep_for(milliseconds(20));
  }
  return false;
}

std::vector<std::uint16_t> registers(sim::wire::ModbusRegisters& drive, std::uint16_t address,
                                     std::size_t count) {
  return drive.read(false, address, count).value_or(std::vector<std::uint16_t>{});
}

class OnALine : public testing::Test {
 protected:
  // Before the drives, which are of the classes derived from this: the line's thread asks them.
  void TearDown() override { close(); }
  void close() {
    devices_.clear();
    line_.reset();
  }
  void open(ModbusLine::Slaves slaves, const std::string& settings) {
    // Its end takes the link away: the one before ends first.
    close();
    line_ = sim::wire::make_rtu_line(folder_ / "line", std::chrono::microseconds(1750), std::move(slaves));
    auto devices = open_module(
        fmt::format("port = \"{}\"\nanswer_ms = 150\n{}", (folder_ / "line").string(), settings), *clock_);
    ASSERT_TRUE(devices.has_value()) << devices.error().text();
    devices_ = std::move(*devices);
  }
  Axis& axis(std::size_t index = 0) { return axis_of(devices_[index]); }
  void make_ready(std::size_t index = 0) {
    done(axis(index).enable(true), "enable");
    done(axis(index).home(), "home");
    const AxisState state = at_rest(axis(index));
    EXPECT_TRUE(state.homed);
    EXPECT_TRUE(state.fault.empty()) << state.fault;
  }

  const test::TemporaryFolder folder_;
  const std::unique_ptr<base::Clock> clock_ = base::make_system_clock();
  std::unique_ptr<ModbusLine> line_;
  std::vector<Device> devices_;
};

class Leadshine : public OnALine {
 protected:
  void open_one(const std::string& more = "", const std::string& module = "") {
    open({{1, &drive_}}, "profile = \"leadshine_pr\"\n" + module + axis_settings("pan", 1, more));
  }
  LeadshineDrive drive_{{2000, {-60000, 60000}, milliseconds(0)}};
};

TEST_F(Leadshine, AMoveIsWrittenAsAPath) {
  open_one();
  make_ready();
  done(axis().move_to(radians(-10), radians(60), radians(300)), "move");
  // Absolute, -10000 counts, 60 deg/s = 60000 counts/s = 360 rpm; 300000 counts/s^2: 1000 rpm in 555.6 ms.
  EXPECT_THAT(registers(drive_, 0x6200, 8), ElementsAre(0x0001, 0xFFFF, 0xD8F0, 360, 556, 556, 0, 0));
  EXPECT_THAT(registers(drive_, 0x6002, 1), ElementsAre(0x0010));
  const AxisState end = at_rest(axis());
  EXPECT_NEAR(end.position_rad, radians(-10), 1e-9);
  EXPECT_NEAR(drive_.position(), -10000, 0.5);
}

TEST_F(Leadshine, NeverFasterThanTheAxisMay) {
  open_one();
  make_ready();
  done(axis().move_to(radians(5), 1e6, 1e6), "move");
  // 120 deg/s and 1000 deg/s^2.
  EXPECT_THAT(registers(drive_, 0x6203, 2), ElementsAre(720, 167));
}

TEST_F(Leadshine, WhatSourcesDisagreeAboutIsAnOption) {
  open_one("[axis.pan.drive]\nabsolute_mode = 0x0041\n");
  make_ready();
  done(axis().move_to(radians(5), kVelocity, kAcceleration), "move");
  EXPECT_THAT(registers(drive_, 0x6200, 1), ElementsAre(0x0041));
}

TEST_F(Leadshine, HomingAndSoftLimitsAreSetUp) {
  open_one(
      "reversed = true\nsoft_low_deg = -20\nsoft_high_deg = 30\n[axis.pan.drive]\nhome_mode = 1\nhome_rpm = "
      "250\n");
  make_ready();
  EXPECT_THAT(registers(drive_, 0x600A, 1), ElementsAre(1));
  EXPECT_THAT(registers(drive_, 0x600F, 4), ElementsAre(250, 30, 100, 100));
  // Reversed: the upper limit of the counts is -(-20) degrees.
  EXPECT_THAT(registers(drive_, 0x6006, 4), ElementsAre(0, 20000, 0xFFFF, 0x8AD0));
  EXPECT_THAT(registers(drive_, 0x6000, 1), ElementsAre(2));
}

TEST_F(Leadshine, IsSetUpAgainAfterAPowerCycle) {
  open_one("[axis.pan.drive]\nhome_rpm = 250\n");
  make_ready();
  drive_.power_cycle();
  const AxisState after = state_of(axis());
  EXPECT_FALSE(after.homed);
  EXPECT_FALSE(after.enabled);
  EXPECT_EQ(axis().move_to(0, kVelocity, kAcceleration).error().code, ErrorCode::refused);
  make_ready();
  EXPECT_THAT(registers(drive_, 0x600F, 1), ElementsAre(250));
}

TEST_F(Leadshine, ItsHomingIsRememberedWhereNoBitTells) {
  open_one("[axis.pan.drive]\nhomed_mask = 0\n");
  EXPECT_FALSE(state_of(axis()).homed);
  make_ready();
  done(axis().move_to(radians(5), kVelocity, kAcceleration), "move");
  EXPECT_TRUE(at_rest(axis()).homed);
  // Its motor was let go: a hand may have turned it.
  done(axis().enable(false), "disable");
  EXPECT_FALSE(state_of(axis()).homed);
  done(axis().enable(true), "enable");
  EXPECT_FALSE(state_of(axis()).homed);
}

TEST_F(Leadshine, AnotherScaleThanTheSettingsIsAnError) {
  open_one("[axis.pan.drive]\ncounts_per_turn = 1600\n");
  const auto state = axis().state();
  ASSERT_FALSE(state.has_value());
  EXPECT_EQ(state.error().code, ErrorCode::device);
  EXPECT_THAT(state.error().text(),
              AllOf(HasSubstr("pan"), HasSubstr("0x0001"), HasSubstr("10000"), HasSubstr("1600")));
  EXPECT_FALSE(axis().home().has_value());
  done(axis().stop(), "a stop goes out all the same");
  EXPECT_EQ(drive_.stops_seen(), 1);
}

TEST_F(Leadshine, AnAlarmIsTold) {
  open_one();
  make_ready();
  drive_.set_alarm_cause(true);
  EXPECT_THAT(state_of(axis()).fault, AllOf(HasSubstr("0x01"), HasSubstr("over-current")));
  const auto moved = axis().move_to(0, kVelocity, kAcceleration);
  ASSERT_FALSE(moved.has_value());
  EXPECT_EQ(moved.error().code, ErrorCode::device);
  EXPECT_THAT(moved.error().text(), HasSubstr("over-current"));
  done(axis().enable(true), "enable");
  EXPECT_FALSE(state_of(axis()).fault.empty());
  drive_.set_alarm_cause(false);
  done(axis().enable(true), "enable");
  const AxisState after = state_of(axis());
  EXPECT_TRUE(after.fault.empty()) << after.fault;
  EXPECT_TRUE(after.enabled);
  EXPECT_TRUE(after.homed);
}

TEST_F(Leadshine, AFastReadingAfterTheStartIsNotTheMoveBefore) {
  LeadshineDrive slow({2000, {-60000, 60000}, milliseconds(60)});
  open({{1, &slow}}, "profile = \"leadshine_pr\"\n" + axis_settings("pan", 1));
  make_ready();
  for (const double target : {4.0, -4.0, 4.0}) {
    done(axis().move_to(radians(target), kVelocity, kAcceleration), "move");
    // The drive says "complete" still, for 60 ms.
    const AxisState at_once = state_of(axis());
    EXPECT_TRUE(at_once.moving) << target;
    const AxisState end = at_rest(axis());
    EXPECT_NEAR(end.position_rad, radians(target), 1e-9);
    EXPECT_FALSE(slow.moving());
  }
  close();  // before `slow`
}

TEST_F(Leadshine, TakesAMomentToBeEnabled) {
  LeadshineDrive slow({2000, {-60000, 60000}, milliseconds(0), milliseconds(60)});
  open({{1, &slow}}, "profile = \"leadshine_pr\"\n" + axis_settings("pan", 1));
  // As rigd does it: one right behind the other.
  make_ready();
  slow.set_alarm_cause(true);
  EXPECT_FALSE(state_of(axis()).enabled);
  slow.set_alarm_cause(false);
  done(axis().enable(true), "enable");
  done(axis().move_to(radians(5), kVelocity, kAcceleration), "move");
  EXPECT_NEAR(at_rest(axis()).position_rad, radians(5), 1e-9);
  // One that is not coming is not waited for long.
  slow.set_alarm_cause(true);
  const auto began = std::chrono::steady_clock::now();
  done(axis().enable(true), "enable");
  EXPECT_LT(std::chrono::steady_clock::now() - began, milliseconds(1000));
  EXPECT_FALSE(state_of(axis()).enabled);
  close();  // before `slow`
}

TEST_F(Leadshine, AStopIsOneWrite) {
  open_one();
  make_ready();
  done(axis().move_to(radians(40), kVelocity, kAcceleration), "move");
  std::this_thread::sleep_for(milliseconds(100));
  done(axis().stop(), "stop");
  EXPECT_EQ(drive_.stops_seen(), 1);
  const AxisState end = at_rest(axis());
  EXPECT_LT(end.position_rad, radians(35));
  EXPECT_TRUE(end.homed);
}

TEST_F(Leadshine, ARegisterThatItDoesNotHaveIsNamed) {
  open_one("[axis.pan.drive]\nreadback = 0x1050\n");
  const auto state = axis().state();
  ASSERT_FALSE(state.has_value());
  EXPECT_EQ(state.error().code, ErrorCode::device);
  EXPECT_THAT(state.error().text(),
              AllOf(HasSubstr("0x1050"), HasSubstr("Illegal data address"), HasSubstr("slave 1")));
}

TEST_F(Leadshine, ATargetBeyondTheDrivesCountingIsRefused) {
  open_one();
  make_ready();
  const auto moved = axis().move_to(1e6, kVelocity, kAcceleration);
  ASSERT_FALSE(moved.has_value());
  EXPECT_EQ(moved.error().code, ErrorCode::bad_input);
}

TEST_F(Leadshine, KeepsTheSilenceThatItsLineNeeds) {
  open_one();
  make_ready();
  for (int i = 0; i < 50; ++i) (void)state_of(axis());
  EXPECT_EQ(line_->unreadable(), 0);
}

TEST_F(Leadshine, OpenedAndAskedManyTimesNothingIsLeft) {
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
  };
  open_one();
  const std::string settings = fmt::format("port = \"{}\"\nprofile = \"leadshine_pr\"\n{}",
                                           (folder_ / "line").string(), axis_settings("pan", 1));
  devices_.clear();
  const auto before = open_files();
  for (int i = 0; i < 100; ++i) {
    const auto devices = open_module(settings, *clock_);
    ASSERT_TRUE(devices.has_value()) << devices.error().text();
    (void)state_of(axis_of(devices->front()));
  }
  EXPECT_EQ(open_files(), before);
}

class ThreeDrives : public OnALine {
 protected:
  void SetUp() override {
    open({{1, &one_}, {2, &two_}, {3, &three_}},
         "profile = \"leadshine_pr\"\nbaud = 115200\nparity = \"even\"\n" + axis_settings("one", 1) +
             axis_settings("two", 2) + axis_settings("three", 3, "profile = \"oriental_az\"\n"));
  }
  LeadshineDrive one_{{}}, two_{{}};
  OrientalDrive three_{{}};
};

TEST_F(ThreeDrives, MoveEachByItself) {
  for (std::size_t i = 0; i < 3; ++i) make_ready(i);
  for (std::size_t i = 0; i < 3; ++i) {
    done(axis(i).move_to(radians(5 + 5 * static_cast<double>(i)), kVelocity, kAcceleration), "move");
  }
  for (std::size_t i = 0; i < 3; ++i) (void)at_rest(axis(i));
  EXPECT_NEAR(one_.position(), 5000, 0.5);
  EXPECT_NEAR(two_.position(), 10000, 0.5);
  EXPECT_NEAR(three_.position(), 15000, 0.5);
}

TEST_F(ThreeDrives, OneThatIsOffIsLostAndTheOthersGoOn) {
  for (std::size_t i = 0; i < 3; ++i) make_ready(i);
  line_->set_off(2, true);
  const auto lost = axis(1).state();
  ASSERT_FALSE(lost.has_value());
  EXPECT_EQ(lost.error().code, ErrorCode::lost);
  EXPECT_THAT(lost.error().text(), HasSubstr("slave 2"));
  EXPECT_TRUE(state_of(axis(0)).homed);
  done(axis(2).move_to(radians(5), kVelocity, kAcceleration), "move");
  EXPECT_NEAR(at_rest(axis(2)).position_rad, radians(5), 1e-9);
  line_->set_off(2, false);
  EXPECT_TRUE(comes_back(axis(1)));
  EXPECT_TRUE(state_of(axis(1)).homed);
}

TEST_F(ThreeDrives, AllAreLostWithTheirLineAndComeBackWithIt) {
  for (std::size_t i = 0; i < 3; ++i) make_ready(i);
  line_->cut();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto gone = axis(i).state();
    ASSERT_FALSE(gone.has_value());
    EXPECT_EQ(gone.error().code, ErrorCode::lost);
  }
  line_->restore();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(comes_back(axis(i)));
    EXPECT_FALSE(state_of(axis(i)).moving);
  }
}

class Oriental : public OnALine {
 protected:
  void open_one(const std::string& profile, const std::string& more = "") {
    open({{4, &drive_}}, fmt::format("profile = \"{}\"\n", profile) + axis_settings("pan", 4, more));
  }
  OrientalDrive drive_{{3000, {-100000, 100000}, milliseconds(0), false}};
};

TEST_F(Oriental, AMoveIsOneDirectDataOperation) {
  open_one("oriental_az");
  make_ready();
  done(axis().move_to(radians(-10), radians(60), radians(300)), "move");
  // Number, type, position, speed in Hz, both rates in steps/s^2, current, trigger, destination.
  EXPECT_THAT(registers(drive_, 0x0058, 18),
              ElementsAre(0, 0, 0, 1, 0xFFFF, 0xD8F0, 0, 60000, 4, 0x93E0, 4, 0x93E0, 0, 1000, 0, 1, 0, 0));
  EXPECT_NEAR(at_rest(axis()).position_rad, radians(-10), 1e-9);
}

TEST_F(Oriental, AJogBeforeHomingIsARelativeOperation) {
  open_one("oriental_az");
  done(axis().enable(true), "enable");
  const double before = drive_.position();
  done(axis().move_by(radians(2), kVelocity, kAcceleration), "move_by");
  EXPECT_THAT(registers(drive_, 0x005A, 4), ElementsAre(0, 2, 0, 2000));
  EXPECT_FALSE(at_rest(axis()).homed);
  EXPECT_NEAR(drive_.position(), before + 2000, 1);
}

TEST_F(Oriental, TellsItsTemperatureAndWhatItKeeps) {
  open_one("oriental_az");
  EXPECT_NEAR(state_of(axis()).temperature_c.value_or(0), 31.0, 1e-9);
  EXPECT_TRUE(axis().capabilities().keeps_position_unpowered);
  EXPECT_FALSE(axis().capabilities().has_limit_switches);
}

TEST_F(Oriental, FreeIsNotEnabled) {
  open_one("oriental_az");
  make_ready();
  done(axis().enable(false), "disable");
  EXPECT_FALSE(state_of(axis()).enabled);
  EXPECT_FALSE(drive_.enabled());
  EXPECT_EQ(axis().move_to(0, kVelocity, kAcceleration).error().code, ErrorCode::refused);
  done(axis().enable(true), "enable");
  EXPECT_TRUE(state_of(axis()).enabled);
}

TEST_F(Oriental, AStopInputThatStayedOnIsReleasedByTheNextMove) {
  open_one("oriental_az");
  make_ready();
  // As where the second half of a stop was lost.
  ASSERT_FALSE(drive_.write(0x007C, {0, 0x0020}).has_value());
  done(axis().move_to(radians(5), kVelocity, kAcceleration), "move");
  EXPECT_NEAR(at_rest(axis()).position_rad, radians(5), 1e-9);
}

TEST_F(Oriental, AnAlarmIsResetByAnEdge) {
  open_one("oriental_az");
  make_ready();
  drive_.set_alarm_cause(true);
  EXPECT_THAT(state_of(axis()).fault, AllOf(HasSubstr("0x30"), HasSubstr("overload")));
  drive_.set_alarm_cause(false);
  EXPECT_FALSE(state_of(axis()).fault.empty());
  done(axis().enable(true), "enable");
  EXPECT_TRUE(state_of(axis()).fault.empty());
  // And a second time: the register went back to 0.
  drive_.set_alarm_cause(true);
  drive_.set_alarm_cause(false);
  done(axis().enable(true), "enable");
  EXPECT_TRUE(state_of(axis()).fault.empty());
}

class OrientalCvd : public OnALine {
 protected:
  void open_one(const std::string& more = "") {
    open({{4, &drive_}}, "profile = \"oriental_cvd\"\n" + axis_settings("pan", 4, more));
  }
  OrientalDrive drive_{{3000, {-20000, 20000}, milliseconds(0), false, true}};
};

TEST_F(OrientalCvd, ReadsTheCommandedPosition) {
  open_one();
  const AxisState state = state_of(axis());
  EXPECT_TRUE(state.enabled);
  EXPECT_FALSE(state.homed);
  EXPECT_FALSE(state.temperature_c.has_value());
  EXPECT_FALSE(axis().capabilities().keeps_position_unpowered);
}

TEST_F(OrientalCvd, HasNoDetectedPosition) {
  open_one("[axis.pan.drive]\nreadback = 0x00CC\n");
  const auto wrong = axis().state();
  ASSERT_FALSE(wrong.has_value());
  EXPECT_THAT(wrong.error().text(), HasSubstr("Illegal data address"));
}

TEST_F(OrientalCvd, HomesAndMoves) {
  open_one();
  EXPECT_EQ(axis().move_to(0, kVelocity, kAcceleration).error().code, ErrorCode::refused);
  make_ready();
  EXPECT_THAT(registers(drive_, 0x02C0, 4), ElementsAre(0, 1, 0, 1));
  EXPECT_NEAR(state_of(axis()).position_rad, 0, 1e-9);
  done(axis().move_to(radians(-10), radians(60), radians(300)), "move");
  EXPECT_THAT(registers(drive_, 0x0058, 18),
              ElementsAre(0, 0, 0, 1, 0xFFFF, 0xD8F0, 0, 60000, 4, 0x93E0, 4, 0x93E0, 0, 1000, 0, 1, 0, 0));
  EXPECT_TRUE(state_of(axis()).moving);
  EXPECT_NEAR(at_rest(axis()).position_rad, radians(-10), 1e-9);
  EXPECT_NEAR(drive_.position(), -10000, 0.5);
}

TEST_F(OrientalCvd, IsToldWhichWayHomeIs) {
  open_one("[axis.pan.drive]\nhome_direction = 0\n");
  done(axis().enable(true), "enable");
  done(axis().home(), "home");
  // The sensor is above: it goes down to the end first.
  double lowest = 0;
  AxisState state;
  for (int i = 0; i < 1000 && !state.homed; ++i) {
    lowest = std::min(lowest, drive_.position());
    state = state_of(axis());
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_TRUE(state.homed);
  EXPECT_LT(lowest, -15000);
  EXPECT_NEAR(at_rest(axis()).position_rad, 0, 1e-9);
}

TEST_F(OrientalCvd, AHomingThatItCannotDoIsAnAlarm) {
  open_one("[axis.pan.drive]\nhome_type = 7\n");
  done(axis().enable(true), "enable");
  done(axis().home(), "home");
  const AxisState state = at_rest(axis());
  EXPECT_FALSE(state.homed);
  EXPECT_THAT(state.fault, HasSubstr("0x70"));
}

TEST_F(OrientalCvd, StopsInAMoveAndInASearchForHome) {
  open_one();
  make_ready();
  done(axis().move_to(radians(-20), radians(60), radians(300)), "move");
  std::this_thread::sleep_for(milliseconds(100));
  done(axis().stop(), "stop");
  EXPECT_EQ(drive_.stops_seen(), 1);
  const AxisState stopped = at_rest(axis());
  EXPECT_GT(stopped.position_rad, radians(-19));
  EXPECT_NEAR(stopped.position_rad, radians(drive_.position() / 1000), radians(0.001));
  EXPECT_TRUE(stopped.homed);
  done(axis().home(), "home");
  std::this_thread::sleep_for(milliseconds(30));
  done(axis().stop(), "stop");
  EXPECT_EQ(drive_.stops_seen(), 2);
  EXPECT_FALSE(at_rest(axis()).homed);
  EXPECT_FALSE(drive_.homed());
  make_ready();
}

TEST_F(OrientalCvd, AfterAPowerCycleItHasToBeHomed) {
  open_one();
  make_ready();
  drive_.power_cycle();
  EXPECT_FALSE(state_of(axis()).homed);
  EXPECT_EQ(axis().move_to(0, kVelocity, kAcceleration).error().code, ErrorCode::refused);
  make_ready();
}

}  // namespace
}  // namespace rig::drivers::modbus
