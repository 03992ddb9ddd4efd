// What the settings mean, what goes into a packet, and that each mistake names its key.
#include "drivers/dmx_light/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/dmx_light/packet.h"

namespace rig::drivers::dmx_light {
namespace {

using ::testing::HasSubstr;

DmxSettings read(const std::string& text) {
  const auto table = base::ConfigTable::parse(text, "rig.toml").value();
  DmxSettings settings = read_dmx_settings(table);
  const auto fine = table.finish();
  EXPECT_TRUE(fine) << fine.error().text();
  return settings;
}

std::string mistakes(const std::string& text) {
  const auto table = base::ConfigTable::parse("port = '/dev/x'\n" + text, "rig.toml").value();
  (void)read_dmx_settings(table);
  const auto fine = table.finish();
  return fine ? "" : fine.error().text();
}

unsigned int value(const std::string& packet, std::size_t channel) {
  return static_cast<unsigned char>(packet.at(channel - 1));
}

TEST(DmxSettings, OnlyPortAndChannelMustBeThere) {
  const auto dmx = read("port = '/dev/serial/by-id/x'\nchannel = 7\n");
  EXPECT_EQ(dmx.line.path, "/dev/serial/by-id/x");
  EXPECT_EQ(dmx.level_channel, 7U);
  EXPECT_EQ(dmx.channels, 512U);
  EXPECT_EQ(dmx.serial, "");
  EXPECT_FALSE(dmx.fine_channel);
  EXPECT_FALSE(dmx.shutter);
  EXPECT_FALSE(dmx.ask_names);
  EXPECT_EQ(dmx.at_start_level, 0);
  EXPECT_EQ(dmx.at_exit_level, 0);
  EXPECT_EQ(dmx.warm_up_s, 0);
}

TEST(DmxSettings, EveryKeyIsRead) {
  const auto dmx = read(R"(
port = "/dev/ttyUSB0"
baud = 115200
attempts = 2
answer_ms = 50
serial = "2301234"
ask_names = true
channels = 128
channel = 1
fine_channel = 2
fixed = [[5, 128], [6, 255]]
at_start_level = 0.25
at_exit_level = 0.5
warm_up_s = 120
[shutter]
channel = 3
open = 20
closed = 200
)");
  EXPECT_EQ(dmx.line.baud, 115200);
  EXPECT_EQ(dmx.retry.attempts, 2);
  EXPECT_EQ(dmx.serial, "02301234");
  EXPECT_TRUE(dmx.ask_names);
  EXPECT_EQ(dmx.channels, 128U);
  EXPECT_EQ(dmx.fine_channel, 2U);
  ASSERT_TRUE(dmx.shutter);
  EXPECT_EQ(dmx.shutter->channel, 3U);
  EXPECT_EQ(dmx.shutter->open, 20);
  EXPECT_EQ(dmx.shutter->closed, 200);
  ASSERT_EQ(dmx.fixed.size(), 2U);
  EXPECT_EQ(dmx.at_start_level, 0.25);
  EXPECT_EQ(dmx.at_exit_level, 0.5);
  EXPECT_EQ(dmx.warm_up_s, 120);

  const std::string packet = make_packet(dmx, 0.5, true);
  EXPECT_EQ(packet.size(), 128U);
  EXPECT_EQ(value(packet, 1), 0x80U);  // 32768 of 65535
  EXPECT_EQ(value(packet, 2), 0x00U);
  EXPECT_EQ(value(packet, 3), 20U);
  EXPECT_EQ(value(packet, 4), 0U);
  EXPECT_EQ(value(packet, 5), 128U);
  EXPECT_EQ(value(packet, 6), 255U);
  EXPECT_EQ(value(make_packet(dmx, 0.5, false), 3), 200U);
}

TEST(DmxSettings, LevelsAreTheNearestStep) {
  const auto eight = read("port = '/dev/x'\nchannel = 24\nchannels = 24\n");
  EXPECT_EQ(value(make_packet(eight, 1, true), 24), 255U);
  EXPECT_EQ(value(make_packet(eight, 0, true), 24), 0U);
  EXPECT_EQ(value(make_packet(eight, 0.5, true), 24), 128U);
  EXPECT_DOUBLE_EQ(nearest_level(eight, 0.5), 128 / 255.0);
  EXPECT_EQ(nearest_level(eight, 1), 1);
  const auto sixteen = read("port = '/dev/x'\nchannel = 1\nfine_channel = 2\n");
  EXPECT_EQ(value(make_packet(sixteen, 1, true), 1), 255U);
  EXPECT_EQ(value(make_packet(sixteen, 1, true), 2), 255U);
  EXPECT_DOUBLE_EQ(nearest_level(sixteen, 0.5), 32768 / 65535.0);
}

TEST(DmxSettings, MistakesNameTheirKey) {
  EXPECT_EQ(mistakes("channel = 1\n"), "");
  EXPECT_THAT(mistakes(""), HasSubstr("channel: is missing"));
  EXPECT_THAT(mistakes("channel = 0\n"), HasSubstr("channel: is 0"));
  EXPECT_THAT(mistakes("channel = 513\n"), HasSubstr("channel: is 513"));
  EXPECT_THAT(mistakes("channel = 30\nchannels = 24\n"), HasSubstr("channel 30 is beyond the 24"));
  EXPECT_THAT(mistakes("channel = 1\nfine_channel = 1\n"), HasSubstr("channel 1 is that of channel already"));
  EXPECT_THAT(mistakes("channel = 1\nfixed = [[1, 5]]\n"), HasSubstr("fixed: channel 1 is that of channel"));
  EXPECT_THAT(mistakes("channel = 1\nfixed = [[2, 256]]\n"), HasSubstr("[2, 256] is no channel"));
  EXPECT_THAT(mistakes("channel = 1\nfixed = [[2.5, 1]]\n"), HasSubstr("is no channel"));
  EXPECT_THAT(mistakes("channel = 1\nfixed = [[2]]\n"), HasSubstr("fixed: row 1"));
  EXPECT_THAT(mistakes("channel = 1\nserial = '123456789'\n"), HasSubstr("serial: '123456789'"));
  EXPECT_THAT(mistakes("channel = 1\nserial = 'EN1234'\n"), HasSubstr("is no serial number"));
  EXPECT_THAT(mistakes("channel = 1\nat_start_level = 2\n"), HasSubstr("at_start_level"));
  EXPECT_THAT(mistakes("channel = 1\n[shutter]\nchannel = 2\nopen = 0\n"), HasSubstr("the same value"));
  EXPECT_THAT(mistakes("channel = 1\n[shutter]\nchannel = 1\n"), HasSubstr("shutter: channel 1 is that of"));
  EXPECT_THAT(mistakes("channel = 1\nlevel = 2\n"), HasSubstr("unknown key"));
}

}  // namespace
}  // namespace rig::drivers::dmx_light
