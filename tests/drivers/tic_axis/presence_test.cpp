// Several Tics, and Tics that come and go.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/tic_axis/transport.h"
#include "tests/drivers/tic_axis/axis_fixture.h"

namespace rig::drivers::tic {
namespace {

using base::ErrorCode;
using sim::wire::TicWorld;
using std::chrono::milliseconds;
using test::log_text;
using testing::HasSubstr;

using TicPresence = test::TicAxisTest;

TEST_F(TicPresence, SeveralTicsAreBusesOfTheirOwn) {
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

TEST_F(TicPresence, ComesBackByItsSerialNumber) {
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

TEST_F(TicPresence, ATicWithAnotherNumberIsNotTakenForIt) {
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
