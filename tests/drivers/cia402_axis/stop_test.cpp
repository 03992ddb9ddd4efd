// Stops: on the wire at once, in every state of the drive, whatever its server is busy with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "tests/drivers/cia402_axis/rig.h"
#include "tests/drivers/cia402_axis/wire_log.h"

namespace rig::drivers::cia402 {
namespace {

using base::ErrorCode;
using base::radians;
using std::chrono::milliseconds;
using testing::HasSubstr;

const can_frame kAsPdo = frame_of(0x201, {0x02, 0x00});
const can_frame kAsSdo = frame_of(0x601, {0x2B, 0x40, 0x60, 0x00, 0x02, 0x00, 0, 0});

// A drive under way, whose server has just not answered a question.
void get_stuck(TestRig& rig) {
  rig.make_ready();
  rig.arrive_deg(-40);
  rig.move_to_deg(40);
  (void)rig.wait_until([](const AxisState& s) { return s.position_rad > radians(-35); });
  rig.station().with(1, [](auto& node, auto) { node.silence_server(true); });
  const auto state = rig.axis().state();
  EXPECT_FALSE(state.has_value());
}

void expect_to_stand(TestRig& rig) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(3);
  while (rig.station().with(1, [](auto& node, auto) { return node.drive().moving(); })) {
    ASSERT_LT(std::chrono::steady_clock::now(), end) << "the drive goes on";
    std::this_thread::sleep_for(milliseconds(2));
  }
  EXPECT_LT(rig.position_deg(), 35);
}

TEST(Stop, GoesPastAServerThatDoesNotAnswer) {
  TestRig rig;
  rig.open("attempts = 1");
  get_stuck(rig);
  WireLog log(rig.hub());
  const auto called = std::chrono::steady_clock::now();
  const auto stopped = rig.axis().stop();
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::lost);  // nobody confirmed it
  expect_to_stand(rig);
  const auto on_the_wire = log.first(kAsPdo);
  ASSERT_TRUE(on_the_wire);
  const auto took = std::chrono::duration<double, std::milli>(*on_the_wire - called).count();
  RecordProperty("stop_to_wire_ms", std::to_string(took));
  std::cout << "from the call to the PDO on the wire: " << took << " ms\n";
  EXPECT_LT(took, 50);
  EXPECT_EQ(rig.stops(), 2);  // and the SDO, which the drive carries out without an answer
}

TEST(Stop, WithoutAPdoAbortsWhatTheServerIsAskedFirst) {
  auto node = quick_node(1);
  node.maps_controlword = node.maps_freely = false;
  TestRig rig({node});
  rig.open("attempts = 1");
  get_stuck(rig);
  EXPECT_THAT(take_log(), HasSubstr("a stop goes as an SDO"));
  WireLog log(rig.hub());
  const auto called = std::chrono::steady_clock::now();
  (void)rig.axis().stop();
  expect_to_stand(rig);
  const auto frames = log.under(0x601);
  ASSERT_GE(frames.size(), 2U);
  EXPECT_EQ(frames[0].frame.data[0], 0x80);
  EXPECT_EQ(frames[1].frame, kAsSdo);
  EXPECT_FALSE(log.first(kAsPdo));
  const auto took = std::chrono::duration<double, std::milli>(frames[1].at - called).count();
  std::cout << "from the call to the SDO on the wire: " << took << " ms\n";
  EXPECT_LT(took, 50);
}

TEST(Stop, IsConfirmedByADriveThatAnswers) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.arrive_deg(-40);
  rig.move_to_deg(40);
  (void)rig.wait_until([](const AxisState& s) { return s.position_rad > radians(-30); });
  ASSERT_TRUE(rig.axis().stop().has_value());
  EXPECT_TRUE(rig.look().moving || !rig.station().with(1, [](auto& n, auto) { return n.drive().moving(); }));
  const AxisState end = rig.wait_until([](const AxisState& s) { return !s.moving; });
  EXPECT_TRUE(end.enabled);  // option 6: it holds
  EXPECT_TRUE(end.homed);
  EXPECT_LT(rig.position_deg(), 0);
  rig.arrive_deg(-10);
}

TEST(Stop, ReachesTheWireInEveryState) {
  TestRig rig;
  rig.open();
  const auto stop_is_seen = [&](const char* when) {
    const int before = rig.stops();
    const auto stopped = rig.axis().stop();
    EXPECT_TRUE(stopped.has_value()) << when << ": " << stopped.error().text();
    EXPECT_GT(rig.stops(), before) << when;
  };
  stop_is_seen("before anything else was asked");
  (void)rig.look();
  stop_is_seen("switched off");
  rig.make_ready();
  stop_is_seen("standing");
  stop_is_seen("stopped already");
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  ASSERT_TRUE(rig.axis().home().has_value());
  stop_is_seen("homing");
  EXPECT_FALSE(rig.wait_until([](const AxisState& s) { return !s.moving; }).homed);
  rig.station().with(1, [](auto& node, auto) { node.drive().trip(0x2350, 0x03); });
  stop_is_seen("in a fault");
  rig.station().with(1, [](auto& node, auto now) { node.nmt(now, 0x80); });
  stop_is_seen("pre-operational");
}

TEST(Stop, OfADriveThatDoesNotStayInItsQuickStopNeedsPowerAnew) {
  TestRig rig;
  rig.open("", "quick_stop_option = 2");
  rig.make_ready();
  rig.arrive_deg(-40);
  rig.move_to_deg(40);
  (void)rig.wait_until([](const AxisState& s) { return s.position_rad > radians(-30); });
  ASSERT_TRUE(rig.axis().stop().has_value());
  const AxisState end = rig.wait_until([](const AxisState& s) { return !s.moving && !s.enabled; });
  EXPECT_TRUE(end.homed);
  const auto moved = rig.axis().move_to(0, 1, 1);
  ASSERT_FALSE(moved.has_value());
  EXPECT_EQ(moved.error().code, ErrorCode::refused);
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  rig.arrive_deg(-10);
}

TEST(Stop, ADriveThatDoesNotLeadBackGoesOverSwitchOnDisabled) {
  auto node = quick_node(1);
  node.drive.leads_back = false;
  TestRig rig({node});
  rig.open();
  rig.make_ready();
  ASSERT_TRUE(rig.axis().stop().has_value());
  rig.arrive_deg(-20);
}

TEST(Stop, WhatWasPlannedIsGone) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.arrive_deg(-40);
  rig.move_to_deg(40);
  (void)rig.wait_until([](const AxisState& s) { return s.position_rad > radians(-30); });
  ASSERT_TRUE(rig.axis().stop().has_value());
  (void)rig.wait_until([](const AxisState& s) { return !s.moving; });
  const double stood = rig.position_deg();
  ASSERT_TRUE(rig.axis().enable(true).has_value());
  std::this_thread::sleep_for(milliseconds(200));
  EXPECT_NEAR(rig.position_deg(), stood, 1 / kCountsPerDeg);
}

}  // namespace
}  // namespace rig::drivers::cia402
