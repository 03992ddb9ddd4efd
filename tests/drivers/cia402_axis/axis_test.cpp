// An axis on a simulated drive: power, moves, homing, faults.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "tests/drivers/cia402_axis/rig.h"
#include "tests/drivers/cia402_axis/wire_log.h"

namespace rig::drivers::cia402 {
namespace {

using base::degrees;
using base::ErrorCode;
using base::radians;
using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

template <typename T>
base::Error error_of(const Result<T>& result) {
  EXPECT_FALSE(result.has_value());
  return result ? base::Error{} : result.error();
}

TEST(Axis, IsEnabledByOneTransitionAfterTheOther) {
  TestRig rig;
  rig.open();
  WireLog log(rig.hub());
  EXPECT_FALSE(rig.look().enabled);
  log.clear();
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  EXPECT_THAT(log.controlwords(), ElementsAre(0x06, 0x07, 0x0F));
  EXPECT_TRUE(rig.look().enabled);
  log.clear();
  ASSERT_TRUE(rig.axis().enable(false).has_value());
  EXPECT_THAT(log.controlwords(), ElementsAre(0x00));
  EXPECT_FALSE(rig.look().enabled);
}

TEST(Axis, SetsUpTheDriveWhenItMeetsIt) {
  TestRig rig;
  rig.open("heartbeat_ms = 50");
  (void)rig.look();
  rig.station().with(1, [](auto& node, auto) {
    EXPECT_EQ(node.value(0x1017), 50U);
    EXPECT_EQ(node.value(0x605A), 6U);
    EXPECT_EQ(node.value(0x6085), 300000U);
    EXPECT_EQ(node.nmt_state(), 5);
  });
  EXPECT_THAT(take_log(), HasSubstr("found 'rigd simulated drive'"));
}

TEST(Axis, HandsOverASetPointByItsHandshake) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  WireLog log(rig.hub());
  rig.move_to_deg(-20);
  // Ready, new set-point and change at once, and the bit taken back.
  EXPECT_THAT(log.controlwords(), ElementsAre(0x2F, 0x3F, 0x2F));
  (void)rig.wait_until([](const AxisState& s) { return !s.moving; });
  EXPECT_NEAR(rig.position_deg(), -20, 1 / kCountsPerDeg);
  rig.station().with(1, [](auto& node, auto) {
    EXPECT_EQ(static_cast<std::int32_t>(node.value(0x607A)), 3000);  // from the low switch at -50
    EXPECT_EQ(node.value(0x6081), 8000U);
    EXPECT_EQ(node.value(0x6083), 40000U);
    EXPECT_EQ(node.value(0x6084), 40000U);
  });
}

TEST(Axis, ANewTargetReplacesTheOldOneAtOnce) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.arrive_deg(-40);
  rig.move_to_deg(40);
  (void)rig.wait_until([](const AxisState& s) { return s.position_rad > radians(-25); });
  rig.arrive_deg(-30);
}

TEST(Axis, IsNeverFasterThanItMay) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  ASSERT_TRUE(rig.axis().move_to(radians(-40), radians(1000), radians(100000)).has_value());
  rig.station().with(1, [](auto& node, auto) {
    EXPECT_EQ(node.value(0x6081), 25000U);
    EXPECT_EQ(node.value(0x6083), 200000U);
  });
  EXPECT_EQ(error_of(rig.axis().move_to(radians(-40), 0, 1)).code, ErrorCode::bad_input);
  EXPECT_EQ(error_of(rig.axis().move_to(1e12, 1, 1)).code, ErrorCode::bad_input);
}

TEST(Axis, UnitsOfTheDriveAreWhatTheSettingsSay) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.open("", "velocity_units_per_count_s = 0.1\nacceleration_units_per_count_s2 = 0.01");
  rig.move_to_deg(-40);
  rig.station().with(1, [](auto& node, auto) {
    EXPECT_EQ(node.value(0x6081), 800U);
    EXPECT_EQ(node.value(0x6083), 400U);
  });
}

TEST(Axis, RefusesToMoveBeforeHomingAndWithoutPower) {
  TestRig rig;
  rig.open();
  const auto early = error_of(rig.axis().move_to(0, 1, 1));
  EXPECT_EQ(early.code, ErrorCode::refused);
  EXPECT_THAT(early.what, HasSubstr("not homed"));
  rig.make_ready();
  ASSERT_TRUE(rig.axis().enable(false).has_value());
  const auto off = error_of(rig.axis().move_to(0, 1, 1));
  EXPECT_EQ(off.code, ErrorCode::refused);
  EXPECT_THAT(off.what, HasSubstr("not enabled"));
}

TEST(Axis, HomesAndShowsTheAngleOfItsSettings) {
  TestRig rig;
  rig.open();
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  ASSERT_TRUE(rig.axis().home().has_value());
  EXPECT_TRUE(rig.look().moving);
  EXPECT_FALSE(rig.look().homed);
  EXPECT_EQ(error_of(rig.axis().move_to(0, 1, 1)).code, ErrorCode::busy);
  EXPECT_EQ(error_of(rig.axis().home()).code, ErrorCode::busy);
  const AxisState end = rig.wait_until([](const AxisState& s) { return !s.moving; });
  EXPECT_TRUE(end.homed);
  EXPECT_NEAR(degrees(end.position_rad), rig.position_deg(), 1 / kCountsPerDeg);
  rig.station().with(1, [](auto& node, auto) {
    EXPECT_EQ(node.value(0x6098), 17U);
    EXPECT_EQ(node.value(0x6099, 1), 20000U);
    EXPECT_EQ(node.value(0x6099, 2), 2000U);
    EXPECT_EQ(node.value(0x609A), 300000U);
  });
}

TEST(Axis, AnOldHomingIsNotTakenForTheNewOne) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.arrive_deg(30);
  ASSERT_TRUE(rig.axis().home().has_value());
  // "Attained" of the first homing: until the drive has begun the second it may still say so.
  const AxisState early = rig.look();
  EXPECT_TRUE(early.moving);
  EXPECT_FALSE(early.homed);
  EXPECT_TRUE(rig.wait_until([](const AxisState& s) { return !s.moving; }).homed);
}

TEST(Axis, AHomingThatFailsIsAFaultUntilItIsAcknowledged) {
  auto node = quick_node(1);
  node.drive.low_switch = -20000;  // behind the hard stop: never found
  TestRig rig({node});
  rig.open();
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  ASSERT_TRUE(rig.axis().home().has_value());
  const AxisState end = rig.wait_until([](const AxisState& s) { return !s.moving; });
  EXPECT_FALSE(end.homed);
  EXPECT_THAT(end.fault, HasSubstr("homing failed"));
  EXPECT_THAT(rig.look().fault, HasSubstr("homing failed"));
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  EXPECT_THAT(rig.look().fault, IsEmpty());
  EXPECT_FALSE(rig.look().homed);
}

TEST(Axis, ReversedTurnsTheOtherWayAndSwapsItsLimits) {
  TestRig rig;
  rig.open("", "reversed = true");
  rig.make_ready();
  // Count 0 is at the low switch of the drive, which is -50 degrees of the axis, and the axis' high end.
  ASSERT_TRUE(rig.axis().move_to(radians(-80), radians(80), radians(400)).has_value());
  (void)rig.wait_until([](const AxisState& s) { return !s.moving; });
  EXPECT_NEAR(rig.position_deg(), -20, 1 / kCountsPerDeg);
  EXPECT_NEAR(degrees(rig.look().position_rad), -80, 1 / kCountsPerDeg);
  rig.station().with(1, [](auto& node, auto) { node.drive().press_limit(false, true); });
  EXPECT_TRUE(rig.look().at_high_limit);
  EXPECT_FALSE(rig.look().at_low_limit);
}

TEST(Axis, LimitInputsThatAreActiveLow) {
  TestRig rig;
  rig.open("", "limits_active_low = true");
  const AxisState state = rig.look();
  EXPECT_TRUE(state.at_low_limit);
  EXPECT_TRUE(state.at_high_limit);
}

TEST(Axis, ADriveWithoutLimitInputsSaysWhatToSet) {
  auto node = quick_node(1);
  node.drive.tells_limits = false;
  TestRig rig({node});
  rig.open();
  const auto error = error_of(rig.axis().state());
  EXPECT_EQ(error.code, ErrorCode::device);
  EXPECT_THAT(error.text(), HasSubstr("limit_switches = false"));
  rig.open("", "limit_switches = false");
  EXPECT_FALSE(rig.axis().capabilities().has_limit_switches);
  EXPECT_FALSE(rig.look().at_low_limit);
}

TEST(Axis, AFaultIsShownInWordsAndResetOnlyWithoutItsCause) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.station().with(1, [](auto& node, auto) { node.drive().trip(0x4310, 0x09); });
  const AxisState state = rig.wait_until([](const AxisState& s) { return !s.fault.empty(); });
  EXPECT_THAT(state.fault, HasSubstr("drive too hot (0x4310"));
  const auto refused = error_of(rig.axis().enable(true));
  EXPECT_EQ(refused.code, ErrorCode::device);
  EXPECT_THAT(refused.what, HasSubstr("drive too hot"));
  EXPECT_EQ(error_of(rig.axis().move_to(0, 1, 1)).code, ErrorCode::device);
  rig.station().with(1, [](auto& node, auto) { node.drive().cause_gone(); });
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  EXPECT_THAT(rig.look().fault, IsEmpty());
  EXPECT_TRUE(rig.look().homed);
  rig.arrive_deg(-10);
}

TEST(Axis, AFaultOfTheEncoderTakesTheReference) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.station().with(1, [](auto& node, auto) {
    node.drive().trip(0x7305, 0x21);
    node.drive().cause_gone();
  });
  (void)rig.wait_until([](const AxisState& s) { return !s.fault.empty(); });
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  EXPECT_FALSE(rig.look().homed);
  EXPECT_EQ(error_of(rig.axis().move_to(0, 1, 1)).code, ErrorCode::refused);
}

TEST(Axis, AnEmergencyThatIsNoFaultIsShownUntilAcknowledged) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.station().with(1, [](auto& node, auto) { node.emergency(0x3220, 0x04); });
  AxisState state = rig.wait_until([](const AxisState& s) { return !s.fault.empty(); });
  EXPECT_THAT(state.fault, HasSubstr("undervoltage inside the drive (0x3220, error register 0x04)"));
  EXPECT_THAT(rig.look().fault, HasSubstr("0x3220"));
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  EXPECT_THAT(rig.look().fault, IsEmpty());
  // One that came and went between two looks is shown once.
  rig.station().with(1, [](auto& node, auto) {
    node.emergency(0x3220, 0x04);
    node.emergency(0, 0);
  });
  (void)rig.wait_until([](const AxisState& s) { return !s.fault.empty(); });
  EXPECT_THAT(rig.look().fault, IsEmpty());
}

TEST(Axis, AFollowingErrorIsAFaultWhileItLasts) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.arrive_deg(-30);
  rig.station().with(1, [](auto& node, auto) { node.drive().set_following_error(true); });
  EXPECT_THAT(rig.look().fault, HasSubstr("following error"));
  rig.station().with(1, [](auto& node, auto) { node.drive().set_following_error(false); });
  EXPECT_THAT(rig.look().fault, IsEmpty());
}

TEST(Axis, AnAbsoluteEncoderIsAlwaysHomed) {
  auto node = quick_node(1);
  node.drive.is_absolute = true;
  TestRig rig({node});
  rig.open_text(fmt::format(R"(interface = "{}"
[axis.pan]
node = 1
counts_per_deg = 100
max_velocity_deg_s = 100
max_acceleration_deg_s2 = 400
keeps_reference = true
)",
                            rig.interface()));
  EXPECT_TRUE(rig.axis().capabilities().keeps_position_unpowered);
  EXPECT_TRUE(rig.look().homed);
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  rig.arrive_deg(15);
  EXPECT_EQ(error_of(rig.axis().home()).code, ErrorCode::refused);
  rig.station().power_cycle(1);
  const AxisState back = rig.wait_until([](const AxisState& s) { return !s.enabled; });
  EXPECT_TRUE(back.homed);
  EXPECT_NEAR(degrees(back.position_rad), 15, 1 / kCountsPerDeg);
}

// What a driver that has just come believes of a drive that was homed before.
struct FoundHomed {
  const char* setting;
  bool forgets;
  bool homed;
};
class FoundAfterARestart : public testing::TestWithParam<FoundHomed> {};

TEST_P(FoundAfterARestart, ReadsWhetherTheDriveIsHomed) {
  auto node = quick_node(1);
  node.drive.referenced_bit = 15;
  node.drive.forgets_attained = GetParam().forgets;
  TestRig rig({node});
  rig.open("", GetParam().setting);
  rig.make_ready();
  rig.arrive_deg(-25);
  rig.open("", GetParam().setting);
  EXPECT_EQ(rig.look().homed, GetParam().homed);
  EXPECT_NEAR(degrees(rig.look().position_rad), -25, 1 / kCountsPerDeg);
  EXPECT_NEAR(rig.position_deg(), -25, 1 / kCountsPerDeg);
  const auto moved = rig.axis().move_to(radians(-20), radians(50), radians(200));
  EXPECT_EQ(moved.has_value(), GetParam().homed);
  // And never of one that has lost its power meanwhile.
  rig.close();
  rig.station().power_cycle(1);
  rig.open("", GetParam().setting);
  EXPECT_FALSE(rig.look().homed);
}

INSTANTIATE_TEST_SUITE_P(Axis, FoundAfterARestart,
                         testing::Values(FoundHomed{"", false, true}, FoundHomed{"", true, false},
                                         FoundHomed{"homed_by = \"statusword_bit\"\nreferenced_bit = 15",
                                                    true, true},
                                         FoundHomed{"homed_by = \"session\"", false, false}));

TEST(Axis, ADriveOfAnotherKindIsRefused) {
  TestRig rig;
  rig.station().with(1, [](auto& node, auto) { node.put(0x1000, 0, 0x000F0191); });
  rig.open();
  const auto error = error_of(rig.axis().state());
  EXPECT_EQ(error.code, ErrorCode::device);
  EXPECT_THAT(error.text(), HasSubstr("no drive of CiA 402"));
  EXPECT_THAT(error.text(), HasSubstr("node 1"));
}

TEST(Axis, WhatTheDriveRefusesIsToldWithItsObject) {
  TestRig rig;
  rig.open("", "quick_stop_option = 8");
  const auto error = error_of(rig.axis().state());
  EXPECT_EQ(error.code, ErrorCode::device);
  EXPECT_THAT(error.text(), HasSubstr("605A:0"));
  EXPECT_THAT(error.text(), HasSubstr("out of range"));
  EXPECT_THAT(error.text(), HasSubstr("quick_stop_option"));
}

}  // namespace
}  // namespace rig::drivers::cia402
