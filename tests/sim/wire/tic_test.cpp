// The simulated Tic against the user's guide, in given time.
#include "sim/wire/tic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/wire/tic_orders.h"

namespace rig::sim::wire {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using Kind = ControlAnswer::Kind;

class SimulatedTic : public testing::Test {
 protected:
  SimulatedTic() { make(tic_factory_settings()); }

  void make(const TicSettingBytes& settings, const TicWorld& world = {}) {
    tic = std::make_unique<Tic>(world, settings, [this] { return now; });
    wait(5);
  }
  static TicSettingBytes with_switches() {
    TicSettingBytes s = tic_factory_settings();
    s[0x5F] = 8, s[0x60] = 4, s[0x5D] = 1;
    return s;
  }
  void wait(int ms) { now += milliseconds(ms); }
  // As wait, fed.
  void run(int ms) {
    for (int i = 0; i < ms; i += 100) {
      quick(0x8C);
      wait(std::min(100, ms - i));
    }
  }
  ControlAnswer send(std::uint8_t request, std::uint16_t value, std::uint16_t index,
                     std::uint16_t length = 0) {
    return tic->control({0x40, request, value, index, length}, {});
  }
  void quick(std::uint8_t request) { EXPECT_EQ(send(request, 0, 0).kind, Kind::done); }
  void write32(std::uint8_t request, std::int32_t value) {
    const auto bits = static_cast<std::uint32_t>(value);
    EXPECT_EQ(
        send(request, static_cast<std::uint16_t>(bits & 0xFFFFU), static_cast<std::uint16_t>(bits >> 16U))
            .kind,
        Kind::done);
  }
  std::uint32_t read(std::uint16_t offset, std::uint16_t width, std::uint8_t request = 0xA1) {
    const auto answer = tic->control({0xC0, request, 0, offset, width}, {});
    EXPECT_EQ(answer.data.size(), width);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < answer.data.size(); ++i)
      value |= static_cast<std::uint32_t>(answer.data[i]) << (8 * i);
    return value;
  }
  [[nodiscard]] int operation() { return static_cast<int>(read(0, 1)); }
  void resume() {
    quick(0x85);
    quick(0x83);
    wait(15);
    EXPECT_EQ(operation(), 10);
  }

  Tic::Time now{milliseconds(1'000'000)};
  std::unique_ptr<Tic> tic;
};

TEST_F(SimulatedTic, WaitsInSafeStartAndStartsUpWithinTheTimeThatItIsOpen) {
  EXPECT_EQ(operation(), 4);
  EXPECT_EQ(tic->error_status(), 0x80);
  EXPECT_FALSE(tic->energized());
  quick(0x83);
  EXPECT_EQ(operation(), 8) << "starting up";
  wait(9);
  EXPECT_EQ(operation(), 8);
  wait(2);
  EXPECT_EQ(operation(), 10);
  EXPECT_TRUE(tic->energized());
  run(1000);
  EXPECT_EQ(operation(), 10) << "once it runs safe start keeps out";
}

TEST_F(SimulatedTic, SafeStartOpensForTwoHundredMilliseconds) {
  make(with_switches());
  tic->press_kill_switch(true);
  quick(0x83);
  wait(150);
  EXPECT_EQ(tic->error_status(), 0x08);
  wait(60);
  EXPECT_EQ(tic->error_status(), 0x88);
  tic->press_kill_switch(false);
  wait(50);
  EXPECT_EQ(operation(), 4) << "released too late";
}

TEST_F(SimulatedTic, TheCommandTimeoutBrakesAndStays) {
  resume();
  write32(0xE3, 1'000'000);
  run(900);
  quick(0x8C);
  wait(999);
  EXPECT_EQ(operation(), 10);
  wait(5);
  EXPECT_EQ(tic->error_status(), 0xC0) << "command timeout, and safe start with it";
  wait(1000);
  EXPECT_EQ(tic->velocity(), 0);
  EXPECT_TRUE(tic->energized()) << "it decelerated to hold";
  quick(0x8C);
  wait(5);
  EXPECT_EQ(tic->error_status(), 0x80);
  EXPECT_EQ(read(0x04, 4, 0xA2) & 0x40U, 0x40U) << "it has occurred";
  EXPECT_EQ(read(0x04, 4) & 0x40U, 0U) << "and was cleared by that reading";
}

// The last target outlives an error: the guide says so, and drivers must not forget it.
TEST_F(SimulatedTic, GoesOnToItsOldTargetAfterAnError) {
  resume();
  write32(0xEC, 0);
  write32(0xE0, 400);
  run(300);
  wait(1500);
  EXPECT_EQ(operation(), 4);
  const auto stood = tic->position();
  EXPECT_LT(stood, 400);
  resume();
  run(5000);
  EXPECT_EQ(tic->position(), 400);
}

TEST_F(SimulatedTic, AHaltIsAbruptAndUncertain) {
  resume();
  write32(0xEC, 17);
  EXPECT_EQ(tic->position(), 17);
  EXPECT_FALSE(tic->position_uncertain());
  write32(0xE3, 2'000'000);
  run(600);
  EXPECT_GT(tic->velocity(), 100);
  quick(0x89);
  EXPECT_EQ(tic->velocity(), 0);
  EXPECT_TRUE(tic->position_uncertain());
  EXPECT_EQ(read(0x09, 1), 0U);
  EXPECT_EQ(tic->stops_seen(), 1);
}

TEST_F(SimulatedTic, DeenergizingLosesThePosition) {
  resume();
  write32(0xEC, 0);
  quick(0x86);
  EXPECT_EQ(operation(), 2);
  EXPECT_EQ(tic->error_status() & 1U, 1U);
  EXPECT_FALSE(tic->energized());
  EXPECT_TRUE(tic->position_uncertain());
}

TEST_F(SimulatedTic, HomesAsTheGuideHasIt) {
  TicSettingBytes s = with_switches();
  s[0x61] = 0x80, s[0x62] = 0xF0, s[0x63] = 0xFA, s[0x64] = 2;  // 50,000,000: 5000 pulses/s
  make(s);
  write32(0xE6, 50'000'000);
  write32(0xEA, 2'000'000);
  resume();
  EXPECT_EQ(send(0x97, 0, 0).kind, Kind::done);
  EXPECT_EQ(read(1, 1) & 0x12U, 0x12U) << "homing, uncertain";
  bool at_switch = false;
  for (int i = 0; i < 1000 && !at_switch; ++i) {
    run(1);
    at_switch = (read(1, 1) & 8U) != 0;
  }
  EXPECT_TRUE(at_switch);
  EXPECT_EQ(tic->velocity(), 0) << "abruptly";
  // It waits for 20 ms, and leaves at 50 pulses/s.
  run(15);
  EXPECT_EQ(tic->velocity(), 0);
  for (int i = 0; i < 50 && (read(1, 1) & 0x10U) != 0; ++i) run(100);
  EXPECT_EQ(read(1, 1) & 0x1EU, 0U) << "no homing, certain, off the switch";
  EXPECT_EQ(tic->position(), 0);
  EXPECT_NEAR(tic->motor_position(), -2500, 1);
  EXPECT_EQ(read(0x09, 1), 0U);
}

TEST_F(SimulatedTic, ALimitSwitchBlocksOneDirectionOnly) {
  make(with_switches());
  resume();
  tic->press_limit(true, true);
  write32(0xE3, 1'000'000);
  run(500);
  EXPECT_EQ(tic->velocity(), 0);
  write32(0xE3, -1'000'000);
  run(500);
  EXPECT_LT(tic->velocity(), -50);
}

TEST_F(SimulatedTic, SwitchesThatItsSettingsDoNotNameAreNotLookedAt) {
  resume();
  tic->press_limit(true, true);
  tic->press_kill_switch(true);
  wait(10);
  EXPECT_EQ(read(1, 1) & 0x0CU, 0U);
  EXPECT_EQ(tic->error_status(), 0);
}

TEST_F(SimulatedTic, AnActiveHighSwitchIsActiveWhenOpen) {
  TicSettingBytes s = with_switches();
  s[0x36] = 8;
  make(s);
  EXPECT_TRUE(read(1, 1) & 4U);
  tic->press_limit(true, true);
  wait(2);
  EXPECT_FALSE(read(1, 1) & 4U);
}

TEST_F(SimulatedTic, LowVoltageAndDriverErrorsResetTheDriver) {
  resume();
  run(300);  // safe start is closed again
  write32(0xEC, 0);
  tic->set_vin_mv(6500);
  wait(5);
  EXPECT_EQ(operation(), 0);
  EXPECT_TRUE(tic->position_uncertain());
  EXPECT_EQ(read(0x33, 2), 6500U);
  tic->set_vin_mv(12000);
  wait(5);
  EXPECT_EQ(operation(), 4);
  TicSettingBytes s = tic_factory_settings();
  s[0x08] = 0;
  make(s);
  resume();
  run(300);
  tic->set_driver_error(true);
  wait(5);
  EXPECT_EQ(operation(), 0);
  tic->set_driver_error(false);
  wait(5);
  EXPECT_EQ(operation(), 0) << "it is not cleared by itself";
  quick(0x8A);
  wait(2);
  EXPECT_EQ(operation(), 4);
}

TEST_F(SimulatedTic, SettingsTakeEffectWhenTheyAreLoaded) {
  EXPECT_EQ(send(0x13, 3, 0x41).kind, Kind::done);
  EXPECT_EQ(read(0x41, 1, 0xA8), 3U);
  EXPECT_EQ(read(0x49, 1), 0U);
  EXPECT_EQ(send(0x94, 5, 0).kind, Kind::done);
  EXPECT_EQ(read(0x49, 1), 5U) << "for now";
  quick(0x10);
  EXPECT_EQ(read(0x49, 1), 3U);
  EXPECT_EQ(tic->setting_writes_seen(), 1);
}

TEST_F(SimulatedTic, LimitsOfTheMotionParameters) {
  write32(0xEA, 5);
  EXPECT_EQ(read(0x1E, 4), 100U);
  write32(0xE9, 0);
  EXPECT_EQ(read(0x1A, 4), 100U) << "as the acceleration";
  write32(0xE9, 7);
  EXPECT_EQ(read(0x1A, 4), 100U);
  write32(0xE6, 600'000'000);
  EXPECT_EQ(read(0x16, 4), 500'000'000U);
}

TEST_F(SimulatedTic, IsStrict) {
  EXPECT_EQ(send(0x89, 1, 0).kind, Kind::stall) << "a quick command has no argument";
  EXPECT_EQ(send(0x94, 0x80, 0).kind, Kind::stall) << "seven bits";
  EXPECT_EQ(send(0x97, 2, 0).kind, Kind::stall);
  EXPECT_EQ(send(0x89, 0, 0, 4).kind, Kind::stall) << "no data stage";
  EXPECT_EQ(send(0x77, 0, 0).kind, Kind::stall);
  EXPECT_EQ(send(0x13, 256, 0x41).kind, Kind::stall);
  EXPECT_EQ(send(0x13, 0, 0x70).kind, Kind::stall);
  EXPECT_EQ(tic->control({0xC0, 0xA1, 0, 0x56, 5}, {}).kind, Kind::stall) << "beyond the end";
  EXPECT_EQ(tic->control({0xC0, 0xA1, 0, 0, 0}, {}).kind, Kind::stall);
  EXPECT_EQ(tic->control({0xC0, 0xA1, 1, 0, 4}, {}).kind, Kind::stall);
  EXPECT_EQ(tic->control({0x21, 0x89, 0, 0, 0}, {}).kind, Kind::stall) << "a request of a class";
}

TEST_F(SimulatedTic, PowerUpForgetsEverything) {
  resume();
  write32(0xEC, 500);
  quick(0x86);
  tic->power_cycle();
  EXPECT_EQ(tic->position(), 0);
  EXPECT_TRUE(tic->position_uncertain());
  wait(5);
  EXPECT_EQ(tic->error_status(), 0x80);
  EXPECT_LT(read(0x35, 4), 10U) << "up time";
}

TEST_F(SimulatedTic, Orders) {
  const auto said = [&](const char* line) { return carry_out_order(*tic, line); };
  make(with_switches());
  EXPECT_TRUE(said("limit forward on"));
  EXPECT_TRUE(said("kill on"));
  EXPECT_TRUE(said("vin 9000"));
  wait(5);
  EXPECT_TRUE(read(1, 1) & 4U);
  EXPECT_EQ(tic->error_status(), 0x88);
  EXPECT_EQ(read(0x33, 2), 9000U);
  EXPECT_TRUE(said("put -2600"));
  EXPECT_EQ(tic->motor_position(), -2600);
  EXPECT_TRUE(said("limit forward off"));
  EXPECT_TRUE(said("driver_error on"));
  EXPECT_TRUE(said("err_line on"));
  wait(5);
  const auto state = said("state");
  ASSERT_TRUE(state);
  EXPECT_THAT(*state, HasSubstr("errors 0x018A"));
  EXPECT_TRUE(said("power_cycle"));
  EXPECT_TRUE(said("  "));
  for (const char* wrong :
       {"limit up on", "limit forward", "kill", "kill maybe", "vin high", "fly", "state now"}) {
    EXPECT_FALSE(said(wrong)) << wrong;
  }
  TicSettingBytes s{};
  EXPECT_TRUE(change_setting(s, "0x41=3"));
  EXPECT_TRUE(change_setting(s, "9=0xF4"));
  EXPECT_EQ(s[0x41], 3);
  EXPECT_EQ(s[9], 0xF4);
  for (const char* wrong : {"", "=", "0x41", "0x41=", "0x70=1", "1=256", "-1=1", "a=1"}) {
    EXPECT_FALSE(change_setting(s, wrong)) << wrong;
  }
}

}  // namespace
}  // namespace rig::sim::wire
