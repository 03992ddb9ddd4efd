// Statusword, heartbeat, emergency and error frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>

#include "drivers/cia402_axis/can_errors.h"
#include "drivers/cia402_axis/node_monitor.h"
#include "drivers/cia402_axis/standstill.h"
#include "drivers/cia402_axis/statusword.h"
#include "tests/drivers/cia402_axis/frames.h"

namespace rig::drivers::cia402 {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using Time = NodeMonitor::Time;

TEST(Statusword, EachStateWithAndWithoutWhatDoesNotMatter) {
  const struct {
    std::uint16_t word;
    Power power;
  } cases[] = {
      {0x0000, Power::not_ready},          {0x0020, Power::not_ready},  {0x0040, Power::switch_on_disabled},
      {0x0060, Power::switch_on_disabled}, {0x0021, Power::ready},      {0x0023, Power::switched_on},
      {0x0027, Power::operation_enabled},  {0x0007, Power::quick_stop}, {0x000F, Power::fault_reaction},
      {0x002F, Power::fault_reaction},     {0x0008, Power::fault},      {0x0028, Power::fault},
  };
  constexpr std::uint16_t kOthers = 0xFF90;  // voltage, warning, remote, mode and maker's bits
  for (const auto& one : cases) {
    EXPECT_EQ(power_of(one.word), one.power) << std::hex << one.word;
    EXPECT_EQ(power_of(one.word | kOthers), one.power) << std::hex << one.word;
  }
  EXPECT_EQ(power_of(0x0001), Power::not_ready);  // no state's bits
}

TEST(Statusword, LeadsStepByStepToOperation) {
  EXPECT_EQ(towards_operation(Power::switch_on_disabled, true), 0x0006);
  EXPECT_EQ(towards_operation(Power::ready, true), 0x0007);
  EXPECT_EQ(towards_operation(Power::switched_on, true), 0x000F);
  EXPECT_EQ(towards_operation(Power::quick_stop, true), 0x000F);
  for (const Power there :
       {Power::operation_enabled, Power::not_ready, Power::fault, Power::fault_reaction}) {
    EXPECT_EQ(towards_operation(there, true), std::nullopt);
  }
  EXPECT_EQ(towards_operation(Power::quick_stop, false), std::nullopt);
}

TEST(NodeMonitor, HearsBootAndHeartbeat) {
  NodeMonitor monitor(3);
  const Time start{};
  monitor.hear(frame_of(0x704, {0x05}), start);
  EXPECT_FALSE(monitor.nmt());
  monitor.hear(frame_of(0x703, {0x00}), start);
  EXPECT_EQ(monitor.boots(), 1);
  EXPECT_EQ(monitor.nmt(), NmtState::pre_operational);
  monitor.hear(frame_of(0x703, {0x05}), start + milliseconds(10));
  EXPECT_EQ(monitor.nmt(), NmtState::operational);
  EXPECT_EQ(monitor.boots(), 1);
  monitor.hear(frame_of(0x703, {0x85}), start + milliseconds(20));  // with the toggle bit of node guarding
  EXPECT_EQ(monitor.last_heartbeat(), start + milliseconds(20));
  for (const can_frame& odd : {frame_of(0x703, {0x44}), frame_of(0x703, {0x05, 0x05}), frame_of(0x703, {})}) {
    monitor.hear(odd, start + milliseconds(30));
    EXPECT_EQ(monitor.last_heartbeat(), start + milliseconds(20));
  }
}

TEST(NodeMonitor, AHeartbeatIsOverdueOnlyWhereItIsExpected) {
  NodeMonitor monitor(3);
  const Time start{};
  EXPECT_FALSE(monitor.is_overdue(start + milliseconds(100000)));
  monitor.expect_heartbeats(start, milliseconds(300));
  EXPECT_FALSE(monitor.is_overdue(start + milliseconds(300)));
  EXPECT_TRUE(monitor.is_overdue(start + milliseconds(301)));
  monitor.hear(frame_of(0x703, {0x05}), start + milliseconds(250));
  EXPECT_FALSE(monitor.is_overdue(start + milliseconds(550)));
  EXPECT_TRUE(monitor.is_overdue(start + milliseconds(551)));
  monitor.expect_nothing();
  EXPECT_FALSE(monitor.is_overdue(start + milliseconds(551)));
}

TEST(NodeMonitor, AnEmergencyStaysUntilAcknowledged) {
  NodeMonitor monitor(3);
  monitor.hear(frame_of(0x083, {0x11, 0x86, 0x21, 1, 2, 3, 4, 5}), {});
  ASSERT_TRUE(monitor.emergency());
  EXPECT_EQ(monitor.emergency()->code, 0x8611);
  EXPECT_EQ(monitor.emergency()->error_register, 0x21);
  EXPECT_EQ(text_of(*monitor.emergency()), "following error (0x8611, error register 0x21)");
  monitor.told();
  EXPECT_TRUE(monitor.emergency());
  monitor.acknowledge();
  EXPECT_FALSE(monitor.emergency());
}

TEST(NodeMonitor, AnEmergencyThatWasNeverSeenOutlastsItsEnd) {
  NodeMonitor monitor(3);
  const can_frame over = frame_of(0x083, {0, 0, 0, 0, 0, 0, 0, 0});
  monitor.hear(frame_of(0x083, {0x20, 0x32, 0x04, 0, 0, 0, 0, 0}), {});
  monitor.hear(over, {});
  ASSERT_TRUE(monitor.emergency());
  monitor.told();
  EXPECT_FALSE(monitor.emergency());
  // And one that was seen ends with the drive's own word.
  monitor.hear(frame_of(0x083, {0x20, 0x32, 0x04, 0, 0, 0, 0, 0}), {});
  monitor.told();
  monitor.hear(over, {});
  EXPECT_FALSE(monitor.emergency());
}

TEST(NodeMonitor, NoEmergencyOfOthersAndNoneThatIsShort) {
  NodeMonitor monitor(3);
  monitor.hear(frame_of(0x084, {0x11, 0x86, 0x21, 0, 0, 0, 0, 0}), {});
  monitor.hear(frame_of(0x083, {0x11, 0x86, 0x21}), {});
  EXPECT_FALSE(monitor.emergency());
}

TEST(Emergency, CodesInWordsTheParticularBeforeTheGeneral) {
  EXPECT_EQ(text_of_error_code(0x4310), "drive too hot");
  EXPECT_EQ(text_of_error_code(0x4999), "temperature");
  EXPECT_EQ(text_of_error_code(0x7305), "encoder 1");
  EXPECT_EQ(text_of_error_code(0x73FF), "position sensor");
  EXPECT_EQ(text_of_error_code(0x8130), "heartbeat or life guard missed by the drive");
  EXPECT_EQ(text_of_error_code(0xFF01), "the maker's own, see the drive's manual");
  for (unsigned code = 0; code <= 0xFFFF; ++code) {
    EXPECT_FALSE(text_of_error_code(static_cast<std::uint16_t>(code)).empty());
  }
  EXPECT_TRUE(loses_reference(0x7305));
  EXPECT_FALSE(loses_reference(0x8611));
}

TEST(ErrorFrames, TellBusOffAndItsEnd) {
  can_frame frame = frame_of(CAN_ERR_FLAG | CAN_ERR_BUSOFF, {0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(read_error_frame(frame).event, BusEvent::bus_off);
  frame.can_id = CAN_ERR_FLAG | CAN_ERR_RESTARTED;
  EXPECT_EQ(read_error_frame(frame).event, BusEvent::restarted);
  frame.can_id = CAN_ERR_FLAG | CAN_ERR_CRTL;
  frame.data[1] = CAN_ERR_CRTL_TX_PASSIVE;
  EXPECT_EQ(read_error_frame(frame).event, BusEvent::warning);
  EXPECT_THAT(read_error_frame(frame).text, HasSubstr("passive"));
  frame.data[1] = CAN_ERR_CRTL_ACTIVE;
  EXPECT_EQ(read_error_frame(frame).event, BusEvent::nothing);
  EXPECT_EQ(read_error_frame(frame_of(0x040, {0, 0, 0, 0, 0, 0, 0, 0})).event, BusEvent::nothing);
}

TEST(Standstill, IsSureOnlyAfterAWhileWithoutChange) {
  Standstill still;
  const base::Time start{};
  const auto at = [&](int ms) { return start + milliseconds(ms); };
  EXPECT_FALSE(still.is_sure(at(0)));
  still.saw(1000, at(0));
  still.saw(1001, at(50));  // an encoder between two counts
  EXPECT_FALSE(still.changed());
  EXPECT_FALSE(still.is_sure(at(99)));
  EXPECT_TRUE(still.is_sure(at(100)));
  still.saw(1010, at(110));
  EXPECT_TRUE(still.changed());
  EXPECT_FALSE(still.is_sure(at(200)));
  still.saw(1010, at(211));
  EXPECT_FALSE(still.changed());
  EXPECT_TRUE(still.is_sure(at(211)));
  still.commanded(at(220));
  EXPECT_FALSE(still.is_sure(at(230)));
}

TEST(Standstill, ACreepingMotorDoesNotStand) {
  Standstill still;
  for (int ms = 0; ms < 1000; ms += 20) {
    still.saw(ms / 20, base::Time{} + milliseconds(ms));
    EXPECT_FALSE(still.is_sure(base::Time{} + milliseconds(ms)));
  }
}

}  // namespace
}  // namespace rig::drivers::cia402
