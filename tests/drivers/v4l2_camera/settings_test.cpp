// Settings, and how their mistakes are told.
#include "drivers/v4l2_camera/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/v4l2_camera/support.h"

namespace rig::drivers::v4l2 {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

const std::string kWho = "device = \"/dev/video0\"\n";
const std::string kGrey = kWho + "pixel_format = \"GREY\"\n";

TEST(Settings, WhatIsNotSaidIsAsUsual) {
  const Settings s = settings_of(kGrey);
  EXPECT_EQ(s.name, "camera");
  EXPECT_EQ(s.called(), "camera /dev/video0");
  EXPECT_EQ(s.bits(), 8);
  EXPECT_FALSE(s.fixed_exposure_s || s.exposure_unit_s || s.longest_exposure_s || s.frame_interval_s);
  EXPECT_TRUE(s.measure_settling);
  EXPECT_EQ(s.settle_frames, 4);
  EXPECT_EQ(s.settle_margin, 1);
  EXPECT_EQ(s.stamp, Stamp::as_told);
  EXPECT_EQ(s.open_within.count(), 10'000);
}

TEST(Settings, WhatIsSaidIsTaken) {
  const Settings s = settings_of(R"(
name = "eye"
device = "/dev/v4l/by-id/usb-Maker_Eye_17-video-index0"
pixel_format = "Y16"
shift_right = 4
width = 640
height = 480
controls = ["gamma=100", "contrast=-3"]
exposure_unit_us = 21.5
longest_exposure_ms = 250
frame_interval_ms = 40
gain_control = "analogue_gain"
gain_unit = "factor"
gain_counts = 16
gain_offset = -1
timestamp = "end"
measure_settling = false
settle_frames = 3
settle_margin = 0
buffers = 8
)");
  EXPECT_EQ(s.name, "eye");
  EXPECT_EQ(s.bits(), 12);
  EXPECT_THAT(s.controls, ElementsAre(Pair("gamma", 100), Pair("contrast", -3)));
  EXPECT_DOUBLE_EQ(*s.exposure_unit_s, 21.5e-6);
  EXPECT_DOUBLE_EQ(*s.longest_exposure_s, 0.25);
  EXPECT_DOUBLE_EQ(*s.frame_interval_s, 0.04);
  EXPECT_EQ(s.gain_control, "analogue_gain");
  EXPECT_EQ(s.gain, (GainScale{GainUnit::factor, 16, -1}));
  EXPECT_EQ(s.stamp, Stamp::end);
  EXPECT_FALSE(s.measure_settling);
  EXPECT_EQ(s.settle_frames, 3);
  EXPECT_EQ(s.settle_margin, 0);
  EXPECT_EQ(s.buffers, 8);
}

TEST(Settings, MistakesNameKeyAndRule) {
  EXPECT_THAT(faults_of("pixel_format = \"GREY\""), HasSubstr("device"));
  EXPECT_THAT(faults_of("device = \"video0\"\npixel_format = \"GREY\""),
              HasSubstr("device: is the whole path"));
  EXPECT_THAT(faults_of(kWho), HasSubstr("pixel_format"));
  EXPECT_THAT(faults_of(kWho + "pixel_format = \"MJPG\""), HasSubstr("pixel_format"));
  EXPECT_THAT(faults_of(kGrey + "shift_right = 2"), HasSubstr("shift_right"));
  EXPECT_THAT(faults_of(kGrey + "width = 640"), HasSubstr("height: width and height"));
  for (const char* wrong : {"gamma", "=3", "gamma=", "gamma=3x", "gamma=99999999999"}) {
    EXPECT_THAT(faults_of(kGrey + "controls = [\"" + wrong + "\"]"), HasSubstr("is not NAME=NUMBER"))
        << wrong;
  }
  EXPECT_THAT(faults_of(kGrey + "fixed_exposure_ms = 5\nexposure_unit_us = 100"),
              HasSubstr("exposure_unit_us"));
  EXPECT_THAT(faults_of(kGrey + "fixed_exposure_ms = 0"), HasSubstr("fixed_exposure_ms"));
  EXPECT_THAT(faults_of(kGrey + "gain_unit = \"bel\""), HasSubstr("gain_unit"));
  EXPECT_THAT(faults_of(kGrey + "timestamp = \"middle\""), HasSubstr("timestamp"));
  EXPECT_THAT(faults_of(kGrey + "settle_frames = 31"), HasSubstr("settle_frames"));
  EXPECT_THAT(faults_of(kGrey + "buffers = 1"), HasSubstr("buffers: is at least 2"));
  EXPECT_THAT(faults_of(kGrey + "settel_frames = 3"), HasSubstr("settel_frames"));
  EXPECT_THAT(faults_of("device = \"unix:/run/eye\"\npixel_format = \"SRGGB10P\""), IsEmpty());
}

}  // namespace
}  // namespace rig::drivers::v4l2
