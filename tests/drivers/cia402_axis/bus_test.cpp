// The bus in trouble: heartbeats missed, power gone, bus-off, the interface down, late answers, other nodes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "drivers/cia402_axis/network.h"
#include "tests/drivers/cia402_axis/rig.h"
#include "tests/drivers/cia402_axis/wire_log.h"

namespace rig::drivers::cia402 {
namespace {

using base::ErrorCode;
using base::radians;
using sim::wire::CanHub;
using std::chrono::milliseconds;
using testing::HasSubstr;

base::Error wait_until_lost(TestRig& rig, milliseconds within = milliseconds(3000)) {
  const auto end = std::chrono::steady_clock::now() + within;
  while (std::chrono::steady_clock::now() < end) {
    const auto state = rig.axis().state();
    if (!state) {
      EXPECT_EQ(state.error().code, ErrorCode::lost) << state.error().text();
      return state.error();
    }
    std::this_thread::sleep_for(milliseconds(10));
  }
  ADD_FAILURE() << "it is never lost";
  return {};
}

TEST(Bus, AMissedHeartbeatIsLostAlthoughTheServerAnswers) {
  TestRig rig;
  rig.open("heartbeat_ms = 50\nheartbeat_timeout_ms = 200");
  rig.make_ready();
  rig.station().with(1, [](auto& node, auto) { node.mute_heartbeat(true); });
  const auto muted = std::chrono::steady_clock::now();
  const auto error = wait_until_lost(rig);
  EXPECT_THAT(error.text(), HasSubstr("no heartbeat for more than 200 ms"));
  EXPECT_GT(std::chrono::steady_clock::now() - muted, milliseconds(140));
  EXPECT_LT(std::chrono::steady_clock::now() - muted, milliseconds(1000));
  // Its server goes on to answer: that alone does not bring it back.
  const auto end = std::chrono::steady_clock::now() + milliseconds(2500);
  while (std::chrono::steady_clock::now() < end) {
    const auto state = rig.axis().state();
    ASSERT_FALSE(state.has_value());
    EXPECT_EQ(state.error().code, ErrorCode::lost);
    std::this_thread::sleep_for(milliseconds(20));
  }
  rig.station().with(1, [](auto& node, auto) { node.mute_heartbeat(false); });
  // It kept its power and says that it is homed.
  const AxisState back = rig.wait_until([](const AxisState& s) { return s.enabled; });
  EXPECT_TRUE(back.homed);
}

TEST(Bus, NoHeartbeatIsExpectedWhereNoneIsAsked) {
  auto node = quick_node(1);
  node.has_heartbeat = false;
  TestRig rig({node});
  rig.open();
  const auto state = rig.axis().state();
  ASSERT_FALSE(state.has_value());
  EXPECT_THAT(state.error().text(), HasSubstr("heartbeat_ms = 0"));
  rig.open("heartbeat_ms = 0");
  rig.make_ready();
  // It was heard to boot; it is started once, and not again with every call.
  rig.station().power_cycle(1);
  (void)rig.wait_until([](const AxisState& s) { return !s.enabled; });
  WireLog log(rig.hub());
  for (int i = 0; i < 5; ++i) (void)rig.look();
  EXPECT_TRUE(log.under(0x000).empty());
  rig.station().with(1, [](auto& n, auto) { EXPECT_EQ(n.nmt_state(), 5); });
}

TEST(Bus, ASilenceOfTheCallerIsNotThatOfTheDrive) {
  TestRig rig;
  rig.open("heartbeat_ms = 20\nheartbeat_timeout_ms = 60");
  rig.make_ready();
  std::this_thread::sleep_for(milliseconds(400));
  EXPECT_TRUE(rig.look().homed);
}

TEST(Bus, APowerCycleIsSeenByItsBootUpMessage) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  (void)take_log();
  rig.station().power_cycle(1);
  // The very first look: the message came before its answers.
  const AxisState state = rig.look();
  EXPECT_FALSE(state.homed);
  EXPECT_FALSE(state.enabled);
  EXPECT_THAT(take_log(), HasSubstr("has booted"));
  rig.station().with(1, [](auto& node, auto) {
    EXPECT_EQ(node.nmt_state(), 5);  // started again
    EXPECT_EQ(node.value(0x1017), 100U);
  });
  rig.make_ready();
  rig.arrive_deg(-10);
}

TEST(Bus, ANodeThatSomebodyStoppedIsStartedAgain) {
  TestRig rig;
  rig.open("heartbeat_ms = 20\nheartbeat_timeout_ms = 200");
  rig.make_ready();
  rig.station().with(1, [](auto& node, auto now) { node.nmt(now, 0x02); });
  (void)rig.wait_until(
      [](const AxisState& s) { return !s.fault.empty(); });  // it was operational, and in operation
  rig.station().with(1, [](auto& node, auto) { EXPECT_EQ(node.nmt_state(), 5); });
}

TEST(Bus, BusOffIsLostUntilTheControllerIsBack) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.hub().set_bus_off(true);
  const auto error = wait_until_lost(rig);
  EXPECT_THAT(error.text(), HasSubstr("bus-off"));
  EXPECT_THAT(error.text(), HasSubstr("restart-ms"));
  const auto begun = std::chrono::steady_clock::now();
  const auto stopped = rig.axis().stop();
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::lost);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, milliseconds(500));
  rig.hub().set_bus_off(false);
  const AxisState back = rig.wait_until([](const AxisState&) { return true; });
  EXPECT_TRUE(back.homed);
}

TEST(Bus, AnInterfaceThatGoesDownComesBack) {
  TestRig rig;
  rig.open();
  rig.make_ready();
  rig.hub().take_down();
  EXPECT_THAT(wait_until_lost(rig).text(), HasSubstr("unix:"));
  EXPECT_EQ(wait_until_lost(rig).code, ErrorCode::lost);
  rig.hub().bring_up();
  const AxisState back = rig.wait_until([](const AxisState&) { return true; });
  EXPECT_TRUE(back.enabled);
  EXPECT_TRUE(back.homed);
  rig.arrive_deg(-10);
}

TEST(Bus, OpensWithoutAnInterfaceAndFindsItLater) {
  TestRig rig;
  rig.hub().take_down();
  rig.open();
  EXPECT_THAT(take_log(), HasSubstr("nobody serves this socket"));
  (void)wait_until_lost(rig);
  rig.hub().bring_up();
  (void)rig.wait_until([](const AxisState&) { return true; });
}

TEST(Bus, AnInterfaceThatDoesNotExistIsNamed) {
  TestRig rig;
  rig.open_text(settings_text("nocan7"));
  const auto error = wait_until_lost(rig);
  EXPECT_THAT(error.text(), HasSubstr("nocan7"));
}

std::string two_axes(const std::string& interface) {
  std::string second = settings_text(interface);
  second = second.substr(second.find("[axis.pan]"));
  second.replace(0, 10, "[axis.tilt]");
  second.replace(second.find("node = 1"), 8, "node = 2");
  return settings_text(interface) + second;
}

TEST(Bus, SeveralNodesShareOneInterface) {
  TestRig rig({quick_node(1), quick_node(2)});
  rig.open_text(two_axes(rig.interface()));
  ASSERT_EQ(rig.devices().size(), 2U);
  EXPECT_EQ(rig.devices()[0].bus, rig.devices()[1].bus);
  for (std::size_t i = 0; i < 2; ++i) {
    ASSERT_TRUE(rig.axis(i).enable(true).has_value());
    ASSERT_TRUE(rig.axis(i).home().has_value());
  }
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!rig.look(0).homed || !rig.look(1).homed) ASSERT_LT(std::chrono::steady_clock::now(), end);
  ASSERT_TRUE(rig.axis(1).move_to(radians(20), radians(80), radians(400)).has_value());
  while (rig.look(1).moving) ASSERT_LT(std::chrono::steady_clock::now(), end);
  EXPECT_NEAR(rig.position_deg(2), 20, 1 / kCountsPerDeg);
  EXPECT_LT(rig.position_deg(1), -40);
}

TEST(Bus, ADriveThatIsGoneDoesNotHoldUpTheOther) {
  TestRig rig({quick_node(1), quick_node(2)});
  rig.open_text(two_axes(rig.interface()));
  (void)rig.look(0);
  (void)rig.look(1);
  rig.station().with(1, [](auto& node, auto now) { node.power_off(now); });
  (void)wait_until_lost(rig);
  const auto begun = std::chrono::steady_clock::now();
  int fine = 0;
  for (int i = 0; i < 20; ++i) {
    EXPECT_FALSE(rig.axis(0).state().has_value());
    fine += rig.axis(1).state().has_value() ? 1 : 0;
  }
  EXPECT_EQ(fine, 20);
  // At most one search for the lost one is in it: 3 attempts of 100 ms.
  EXPECT_LT(std::chrono::steady_clock::now() - begun, milliseconds(900));
}

TEST(Bus, NoCallOutlastsItsBound) {
  TestRig rig;
  rig.open("call_ms = 300");
  rig.make_ready();
  rig.station().with(1, [](auto& node, auto) { node.silence_server(true); });
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_FALSE(rig.axis().move_to(0, 1, 1).has_value());
  EXPECT_LT(std::chrono::steady_clock::now() - begun, milliseconds(450));
}

TEST(Bus, ADriveThatAnswersSlowlyIsMetInSeveralCalls) {
  auto node = quick_node(1);
  node.answer_after = milliseconds(30);
  TestRig rig({node});
  rig.open("call_ms = 450");
  int calls = 1;
  while (true) {
    const auto state = rig.axis().state();
    if (state) break;
    EXPECT_EQ(state.error().code, ErrorCode::lost);
    EXPECT_THAT(state.error().text(), HasSubstr("call_ms"));
    ASSERT_LT(++calls, 20);
  }
  EXPECT_GT(calls, 1);
  EXPECT_THAT(take_log(), testing::Not(HasSubstr("no answer")));  // it counted as slow, not as gone
}

class NetworkOnTheBus : public testing::Test {
 protected:
  static NetworkSettings settings(const TestRig& rig_of_it, int attempts) {
    NetworkSettings settings;
    settings.interface = rig_of_it.interface();
    settings.retry = {attempts, milliseconds(100)};
    return settings;
  }
  static Steady::time_point soon() { return Steady::now() + milliseconds(1000); }
  static std::uint32_t number_in(const Result<std::string>& bytes) {
    EXPECT_TRUE(bytes.has_value()) << bytes.error().text();
    std::uint32_t value = 0;
    if (bytes && bytes->size() == sizeof value) std::memcpy(&value, bytes->data(), sizeof value);
    return value;
  }

  TestRig rig_;
  static constexpr Object kVelocity{0x6081, 0};
};

TEST_F(NetworkOnTheBus, ALateAnswerToTheVerySameQuestionIsNotTaken) {
  Network network(settings(rig_, 1), {1}, rig_.clock(), [](auto, const auto&) {});
  rig_.station().with(1, [](auto& node, auto) { node.put(0x6081, 0, 1111); });
  EXPECT_EQ(number_in(network.upload(1, kVelocity, soon())), 1111U);
  rig_.hub().spoil(CanHub::Fault::delay, 0x581, 1, milliseconds(150));
  const auto late = network.upload(1, kVelocity, soon());
  ASSERT_FALSE(late.has_value());
  EXPECT_EQ(late.error().code, ErrorCode::lost);
  rig_.station().with(1, [](auto& node, auto) { node.put(0x6081, 0, 2222); });
  // The answer with 1111 arrives while this one is asked.
  EXPECT_EQ(number_in(network.upload(1, kVelocity, soon())), 2222U);
}

TEST_F(NetworkOnTheBus, ADoubledAnswerIsNotTakenForTheNext) {
  Network network(settings(rig_, 1), {1}, rig_.clock(), [](auto, const auto&) {});
  rig_.hub().spoil(CanHub::Fault::duplicate, 0x581, 3);
  rig_.station().with(1, [](auto& node, auto) { node.put(0x6081, 0, 1111); });
  EXPECT_EQ(number_in(network.upload(1, kVelocity, soon())), 1111U);
  EXPECT_EQ(number_in(network.upload(1, {0x6083, 0}, soon())), 10000U);
  EXPECT_EQ(number_in(network.upload(1, {0x6084, 0}, soon())), 10000U);
}

TEST_F(NetworkOnTheBus, MissingAndGarbledAnswersAreAskedForAgain) {
  Network network(settings(rig_, 4), {1}, rig_.clock(), [](auto, const auto&) {});
  rig_.hub().spoil(CanHub::Fault::drop, 0x581, 1);
  EXPECT_EQ(number_in(network.upload(1, kVelocity, soon())), 1000U);
  rig_.hub().spoil(CanHub::Fault::garble, 0x581, 1);
  EXPECT_EQ(number_in(network.upload(1, kVelocity, soon())), 1000U);
}

TEST_F(NetworkOnTheBus, ANameInSegmentsIsReadWhole) {
  Network network(settings(rig_, 2), {1}, rig_.clock(), [](auto, const auto&) {});
  EXPECT_EQ(network.upload(1, {0x1008, 0}, soon()).value_or(""), "rigd simulated drive");
  // A doubled segment has the wrong toggle bit: the transfer is aborted and begun anew.
  WireLog log(rig_.hub());
  rig_.hub().spoil(CanHub::Fault::duplicate, 0x581, 2);
  EXPECT_EQ(network.upload(1, {0x1008, 0}, soon()).value_or(""), "rigd simulated drive");
  EXPECT_TRUE(log.first(frame_of(0x601, {0x80, 0x08, 0x10, 0x00, 0x00, 0x00, 0x03, 0x05})));
}

TEST_F(NetworkOnTheBus, WhatANodeDoesNotHaveIsNotFound) {
  Network network(settings(rig_, 2), {1}, rig_.clock(), [](auto, const auto&) {});
  EXPECT_EQ(network.upload(1, {0x2345, 0}, soon()).error().code, ErrorCode::not_found);
  EXPECT_EQ(network.upload(1, {0x6099, 9}, soon()).error().code, ErrorCode::not_found);
  const auto read_only = network.download(1, {0x6041, 0}, std::string_view("\0\0", 2), soon());
  EXPECT_EQ(read_only.error().code, ErrorCode::device);
}

}  // namespace
}  // namespace rig::drivers::cia402
