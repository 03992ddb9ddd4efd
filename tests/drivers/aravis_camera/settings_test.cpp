// Settings, and how their mistakes are told.
#include "drivers/aravis_camera/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/aravis_camera/support.h"

namespace rig::drivers::aravis {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

TEST(Settings, WhatIsNotSaidIsAsUsual) {
  const Settings s = settings_of("serial = \"23\"");
  EXPECT_EQ(s.device, "camera");
  EXPECT_EQ(s.find_by, FindBy::serial);
  EXPECT_EQ(s.format.name, "Mono16");
  EXPECT_EQ(s.bits(), 16);
  EXPECT_EQ(s.packet_size, 0);
  EXPECT_TRUE(s.packet_resend);
  EXPECT_FALSE(s.packet_sockets);
  EXPECT_EQ(s.socket_buffer_bytes, 4 << 20);
  EXPECT_EQ(s.answer.count(), 1000);
  EXPECT_FALSE(s.readout_s.has_value());
}

TEST(Settings, WhatIsSaidIsTaken) {
  const Settings s = settings_of(R"(
name = "eye"
id = "Vendor-17"
pixel_format = "BayerRG12p"
width = 640
offset_x = 2
readout_ms = 20
rolling_shutter = true
features = ["GammaEnable=false", "BlackLevel=3.5"]
trigger_line = "Line1"
trigger_edge = "falling"
gain_unit = "factor"
gain_counts = 10
packet_size = 9000
packet_resend = false
packet_timeout_ms = 1.5
)");
  EXPECT_EQ(s.device, "eye");
  EXPECT_EQ(s.find, "Vendor-17");
  EXPECT_EQ(s.bits(), 12);
  EXPECT_EQ(s.format.bayer, "RGGB");
  EXPECT_EQ(s.offset_x, 2);
  EXPECT_DOUBLE_EQ(*s.readout_s, 0.02);
  EXPECT_EQ(s.rolling_shutter, true);
  EXPECT_THAT(s.features, ElementsAre(Pair("GammaEnable", "false"), Pair("BlackLevel", "3.5")));
  EXPECT_EQ(s.trigger_edge, "FallingEdge");
  EXPECT_EQ(s.gain, (GainScale{GainUnit::factor, 10, 0}));
  EXPECT_FALSE(s.packet_resend);
  EXPECT_EQ(s.packet_timeout.count(), 1500);
}

TEST(Settings, ACameraIsNamedInOneWay) {
  EXPECT_THAT(faults_of(""), HasSubstr("exactly one of id, serial and address"));
  EXPECT_THAT(faults_of("id = \"a\"\nserial = \"b\""), HasSubstr("exactly one of id, serial and address"));
  EXPECT_THAT(faults_of("address = \"\""), HasSubstr("address"));
  EXPECT_THAT(faults_of("address = \"10.0.0.2\"\ntransport = \"usb\""), HasSubstr("a USB camera has none"));
}

TEST(Settings, MistakesNameKeyAndRule) {
  const std::string who = "id = \"a\"\n";
  EXPECT_THAT(faults_of(who + "pixel_format = \"RGB8\""), HasSubstr("pixel_format"));
  EXPECT_THAT(faults_of(who + "pixel_format = \"Mono12\"\nshift_right = 4"), HasSubstr("shift_right"));
  EXPECT_THAT(faults_of(who + "pixel_format = \"BayerRG8\"\noffset_x = 3"),
              HasSubstr("offset_x: must be even"));
  EXPECT_THAT(faults_of(who + "pixel_format = \"BayerRG8\"\noffset_y = 3"),
              HasSubstr("offset_y: must be even"));
  EXPECT_THAT(faults_of(who + "features = [\"GammaEnable\"]"), HasSubstr("NAME=VALUE"));
  EXPECT_THAT(faults_of(who + "packet_size = 100"), HasSubstr("at least 220"));
  EXPECT_THAT(faults_of(who + "trigger_line = \"Software\""), HasSubstr("is an input of the camera"));
  EXPECT_THAT(faults_of(who + "buffers = 1"), HasSubstr("buffers"));
  EXPECT_THAT(faults_of(who + "gain_unit = \"bel\""), HasSubstr("gain_unit"));
  EXPECT_THAT(faults_of(who + "packetsize = 100"), HasSubstr("packetsize"));
  EXPECT_THAT(faults_of(who + "offset_x = 3"), IsEmpty()) << "without a mosaic any offset will do";
}

}  // namespace
}  // namespace rig::drivers::aravis
