// The driver on a simulated video device, which runs free and shows its settings late. Every frame carries in
// its pixels how it was taken.
#include <cerrno>
#include <cmath>
#include <gmock/gmock.h>
#include <limits>
#include <linux/videodev2.h>

#include "tests/drivers/v4l2_camera/support.h"

namespace rig::drivers::v4l2 {
namespace {

using base::ErrorCode;
using sim::wire::ExposureKind;
using sim::wire::V4l2CameraOptions;
using std::chrono::milliseconds;
using testing::HasSubstr;

using Device = sim::wire::V4l2Camera;

const std::string kGrey = "pixel_format = \"GREY\"\n";
const std::string kStated = kGrey + "measure_settling = false\nsettle_frames = 2\n";

struct Wired {
  explicit Wired(V4l2CameraOptions options = {}) : device(path, std::move(options)) {}
  [[nodiscard]] std::string name() const { return device_of(path); }
  [[nodiscard]] base::Result<std::unique_ptr<V4l2Camera>> open(const std::string& settings) {
    return V4l2Camera::open(settings_of("device = \"" + name() + "\"\n" + settings), *clock, said.log());
  }

  const std::filesystem::path path = socket_path();
  Device device;
  const std::unique_ptr<base::Clock> clock = base::make_system_clock();
  Said said;
};

TEST(Camera, EveryFormatComesAsItWasPaintedWithAndWithoutPadding) {
  for (const std::uint32_t padding : {0U, 24U}) {
    Wired wired({.padding = padding});
    for (const char* name : {"GREY", "Y10", "Y10P", "Y12", "Y12P", "Y14", "Y16", "SRGGB8", "SGRBG10",
                             "SGBRG10P", "SBGGR12", "SRGGB12P", "SRGGB16"}) {
      SCOPED_TRACE(fmt::format("{} with {} bytes after each line", name, padding));
      Rig rig(wired.name(),
              fmt::format("pixel_format = \"{}\"\nmeasure_settling = false\nsettle_frames = 2", name));
      EXPECT_EQ(rig.capabilities().bits, find_pixel_format(name)->bits);
      EXPECT_EQ(rig.capabilities().bayer, find_pixel_format(name)->bayer);
      expect_frame(rig, 1.5e-3);
    }
  }
}

// The delay is the device's own; the driver has to find it.
TEST(Camera, HowManyFramesASettingTakesIsMeasured) {
  for (const bool start_stamps : {true, false}) {
    for (const int delay : {0, 1, 2, 3, 6}) {
      SCOPED_TRACE(fmt::format("{} frames, stamps of the {}", delay, start_stamps ? "start" : "end"));
      Wired wired({.delay_frames = delay, .start_stamps = start_stamps});
      // What is stated is wrong, and not used.
      Rig rig(wired.name(), kGrey + "settle_frames = 0\nsettle_margin = 1\n");
      EXPECT_TRUE(rig.said().has("frames, measured")) << "it was not measured";
      for (int i = 0; i < 8; ++i) {
        expect_frame(rig, i % 2 == 0 ? 1e-3 : 9e-3);
        if (HasFatalFailure()) return;
      }
    }
  }
}

TEST(Camera, WithTooFewFramesStatedOldOnesWouldBeDelivered) {
  Wired wired({.delay_frames = 4});
  Rig rig(wired.name(), kGrey + "measure_settling = false\nsettle_frames = 0\nsettle_margin = 0\n");
  int wrong = 0;
  for (int i = 0; i < 6; ++i) {
    const double exposure_s = i % 2 == 0 ? 1e-3 : 9e-3;
    const auto frame = rig.take(exposure_s);
    ASSERT_TRUE(frame.has_value() && frame->has_value());
    const auto painted = rig.painted();
    ASSERT_TRUE(painted.has_value());
    if (std::abs(painted->exposure_us * 1e-6 - exposure_s) > 1e-6) ++wrong;
  }
  EXPECT_GT(wrong, 0) << "this device shows settings at once: the other tests prove nothing";
}

TEST(Camera, InTheDarkTheStatedNumberIsUsedAndSaid) {
  Wired wired({.delay_frames = 3});
  wired.device.set_light(0);
  Rig rig(wired.name(), kGrey + "settle_frames = 3\n");
  EXPECT_TRUE(rig.said().has("could not be measured: the picture is too dark"));
  EXPECT_TRUE(rig.said().has("settle_frames says 3"));
  for (int i = 0; i < 6; ++i) expect_frame(rig, i % 2 == 0 ? 1e-3 : 9e-3);
}

TEST(Camera, ACameraThatIsTooSlowToBeMeasuredIsNotWaitedFor) {
  Wired wired({.interval_s = 0.4});
  const auto begun = std::chrono::steady_clock::now();
  Rig rig(wired.name(), kGrey + "settle_frames = 2\n");
  EXPECT_LT(std::chrono::steady_clock::now() - begun, milliseconds(2000));
  EXPECT_TRUE(rig.said().has("its frames come too slowly; settle_frames says 2"));
  expect_frame(rig, 1e-3);
}

TEST(Camera, InBrightLightShorterExposuresAreTried) {
  Wired wired({.interval_s = 0.02, .delay_frames = 3});
  wired.device.set_light(255);
  Rig rig(wired.name(), kGrey + "settle_frames = 0\n");
  EXPECT_TRUE(rig.said().has("frames, measured"));
  for (int i = 0; i < 4; ++i) expect_frame(rig, i % 2 == 0 ? 1e-3 : 9e-3);
}

TEST(Camera, WhatIsAutomaticIsSwitchedOff) {
  Wired wired;
  Rig rig(wired.name(), kStated + "controls = [\"brightness=7\", \"power_line_frequency=1\"]\n");
  expect_frame(rig, 2e-3);
  EXPECT_EQ(wired.device.control("Auto Exposure"), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(wired.device.control("Gain, Automatic"), 0);
  EXPECT_EQ(wired.device.control("White Balance, Automatic"), 0);
  EXPECT_EQ(wired.device.control("Backlight Compensation"), 0);
  EXPECT_EQ(wired.device.control("Power Line Frequency"), 1) << "what is asked for comes last";
  EXPECT_EQ(wired.device.control("Brightness"), 7);
  EXPECT_EQ(wired.device.control("Gain"), 0) << "0 dB";
}

TEST(Camera, GainIsSetInTheCamerasUnit) {
  Wired wired({.gain_min = 16});
  const auto unsaid = wired.open(kStated);
  ASSERT_FALSE(unsaid.has_value());
  EXPECT_THAT(unsaid.error().text(), HasSubstr("gain 1 would be 0"));
  EXPECT_THAT(unsaid.error().text(), HasSubstr("gain_counts"));
  Rig rig(wired.name(), kStated + "gain_unit = \"factor\"\ngain_counts = 16\n");
  const auto frame = rig.take(1e-3, 2.5);
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_EQ(rig.painted()->gain, 40);
  EXPECT_DOUBLE_EQ((*frame)->gain, 2.5);
  const auto refused = rig.camera().trigger(1e-3, 16);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
  EXPECT_THAT(refused.error().text(), HasSubstr("takes 16 to 255"));
}

TEST(Camera, ExposuresAreRoundedToTheControlAndReportedAsTheyAre) {
  Wired wired;
  Rig rig(wired.name(), kStated);
  EXPECT_DOUBLE_EQ(rig.capabilities().min_exposure_s, 100e-6);
  EXPECT_DOUBLE_EQ(rig.capabilities().max_exposure_s, 0.5);
  const auto frame = rig.take(1.23e-3);
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_DOUBLE_EQ((*frame)->exposure_s, 1.2e-3);
  EXPECT_EQ(rig.painted()->exposure_us, 1200U);
  for (const double exposure_s : {99e-6, 0.51, std::numeric_limits<double>::quiet_NaN()}) {
    const auto refused = rig.camera().trigger(exposure_s, 1);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
    EXPECT_THAT(refused.error().text(), HasSubstr("only for 100 to 500000 us"));
  }
}

TEST(Camera, ASensorThatCountsLinesNeedsToBeToldHowLongTheyAre) {
  Wired wired({.exposure = ExposureKind::lines});
  const auto unsaid = wired.open(kStated);
  ASSERT_FALSE(unsaid.has_value());
  EXPECT_EQ(unsaid.error().code, ErrorCode::bad_input);
  EXPECT_THAT(unsaid.error().text(), HasSubstr("exposure_unit_us"));
  Rig rig(wired.name(), kStated + "exposure_unit_us = 20\nlongest_exposure_ms = 50\n");
  EXPECT_DOUBLE_EQ(rig.capabilities().min_exposure_s, 80e-6);
  EXPECT_DOUBLE_EQ(rig.capabilities().max_exposure_s, 50e-3);
  expect_frame(rig, 1.02e-3);
}

TEST(Camera, WithoutAnExposureControlOnlyTheFixedOneIsTaken) {
  Wired wired({.interval_s = 0.006, .exposure = ExposureKind::none});
  const auto unsaid = wired.open(kStated);
  ASSERT_FALSE(unsaid.has_value());
  EXPECT_THAT(unsaid.error().text(), HasSubstr("fixed_exposure_ms"));
  Rig rig(wired.name(), kGrey + "fixed_exposure_ms = 5\nsettle_frames = 0\n");
  EXPECT_TRUE(rig.said().has("frames, measured")) << "by its gain";
  EXPECT_DOUBLE_EQ(rig.capabilities().min_exposure_s, 5e-3);
  EXPECT_DOUBLE_EQ(rig.capabilities().max_exposure_s, 5e-3);
  expect_frame(rig, 5e-3);
  const auto refused = rig.camera().trigger(6e-3, 1);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().text(), HasSubstr("its exposure is fixed: 5000 us"));
  // Its gain shows as late as an exposure would.
  for (const double gain : {4.0, 1.0, 4.0}) {
    const auto frame = rig.take(5e-3, gain);
    ASSERT_TRUE(frame.has_value() && frame->has_value());
    EXPECT_EQ(rig.painted()->gain, gain == 1 ? 0 : 12);
  }
}

TEST(Camera, FormatsThatAreNoMeasureOfLightAreRefusedWithWhatThereIs) {
  Wired wired;
  const auto missing = wired.open("pixel_format = \"SRGGB14\"");
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().code, ErrorCode::bad_input);
  EXPECT_THAT(missing.error().text(), HasSubstr("it has YUYV (not raw), MJPG (compressed), GREY, Y10"));
}

TEST(Camera, ASizeThatItHasNotIsRefusedWithTheNearest) {
  Wired wired({.sizes = {{64, 48}, {128, 96}}});
  const auto wrong = wired.open(kStated + "width = 120\nheight = 90");
  ASSERT_FALSE(wrong.has_value());
  EXPECT_THAT(wrong.error().text(), HasSubstr("the nearest is 128 x 96"));
  Rig rig(wired.name(), kStated + "width = 128\nheight = 96");
  EXPECT_EQ(rig.capabilities().width, 128);
  expect_frame(rig, 1e-3);
}

TEST(Camera, TheFrameIntervalIsSetOrSaid) {
  Wired wired;
  {
    Rig rig(wired.name(), kStated + "frame_interval_ms = 20\n");
    EXPECT_DOUBLE_EQ(rig.capabilities().readout_s, (2 + 1 + 2) * 0.02);
    expect_frame(rig, 1e-3);
  }
  const auto too_quick = wired.open(kStated + "frame_interval_ms = 1\n");
  ASSERT_FALSE(too_quick.has_value());
  EXPECT_THAT(too_quick.error().text(), HasSubstr("the nearest is 4.000 ms"));
  Wired silent({.tells_interval = false});
  const auto unsaid = silent.open(kStated);
  ASSERT_FALSE(unsaid.has_value());
  EXPECT_THAT(unsaid.error().text(), HasSubstr("frame_interval_ms"));
  Rig rig(silent.name(), kStated + "frame_interval_ms = 4\n");
  expect_frame(rig, 1e-3);
}

TEST(Camera, DamagedAndLostFramesAreReplacedByOthersOfTheSameSetting) {
  Wired wired;
  Rig rig(wired.name(), kStated);
  for (const auto how : {Device::Trouble::flagged, Device::Trouble::cut_off, Device::Trouble::dropped}) {
    for (int i = 0; i < 6; ++i) {
      wired.device.spoil_next(how, 6);
      expect_frame(rig, i % 2 == 0 ? 1e-3 : 5e-3);
    }
  }
  EXPECT_TRUE(rig.said().has("damaged on their way"));
}

TEST(Camera, LostFramesAreCounted) {
  Wired wired;
  Rig rig(wired.name(), kStated);
  const auto first = rig.take(1e-3);
  ASSERT_TRUE(first.has_value() && first->has_value());
  const auto number = rig.painted()->frame;
  wired.device.spoil_next(Device::Trouble::dropped, 3);
  const auto second = rig.take(5e-3);
  ASSERT_TRUE(second.has_value() && second->has_value());
  EXPECT_EQ((*second)->counter - (*first)->counter, rig.painted()->frame - number)
      << "the camera's own count is handed on";
}

TEST(Camera, NoClockNoFrame) {
  Wired wired;
  Rig rig(wired.name(), kStated);
  expect_frame(rig, 1e-3);
  wired.device.spoil_next(Device::Trouble::unknown_clock, 50);
  const auto frame = rig.take(2e-3);
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code, ErrorCode::device);
  EXPECT_THAT(frame.error().text(), HasSubstr("no clock that is known"));
}

TEST(Camera, ACameraThatExposesShorterThanItSaysIsFound) {
  Wired wired({.clips_exposure = true});
  Rig rig(wired.name(), kStated);
  expect_frame(rig, 2e-3);
  const auto frame = rig.take(100e-3);
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code, ErrorCode::device);
  EXPECT_THAT(frame.error().text(), HasSubstr("they were not exposed for 100.0 ms"));
  expect_frame(rig, 3e-3);
}

TEST(Camera, ItIsOursAlone) {
  Wired wired;
  Rig rig(wired.name(), kStated);
  const auto second = wired.open(kStated);
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, ErrorCode::busy);
  EXPECT_THAT(second.error().text(), HasSubstr("another program uses it: it failed to be ours alone"));
  const auto beside = wired.open(kStated + "exclusive = false\n");
  ASSERT_FALSE(beside.has_value());
  EXPECT_EQ(beside.error().code, ErrorCode::busy);
  expect_frame(rig, 1e-3);
}

TEST(Camera, AFullQueueIsEmptiedBeforeAnExposure) {
  Wired wired;
  Rig rig(wired.name(), kStated);
  for (int i = 0; i < 3; ++i) {
    expect_frame(rig, i % 2 == 0 ? 1e-3 : 5e-3);
    std::this_thread::sleep_for(milliseconds(100));
  }
  EXPECT_FALSE(rig.said().has("were lost")) << "nobody asked for them";
  EXPECT_GT(wired.device.dropped(), 0);
}

TEST(Camera, WithStampsOfTheEndNoFrameIsFromBeforeItsSetting) {
  for (const bool start_stamps : {true, false}) {
    Wired wired({.start_stamps = start_stamps});
    Rig rig(wired.name(), kStated);
    const auto before = rig.clock().now();
    for (int i = 0; i < 20; ++i) {
      expect_frame(rig, i % 2 == 0 ? 500e-6 : 12e-3);
      if (HasFatalFailure()) return;
    }
    const auto triggered = rig.clock().now();
    const auto frame = rig.take(12e-3);
    ASSERT_TRUE(frame.has_value() && frame->has_value());
    EXPECT_GE((*frame)->started, triggered);
    EXPECT_LE((*frame)->started, rig.clock().now());
    EXPECT_GT(triggered, before);
  }
}

TEST(Camera, AControlThatFailsIsAnErrorAndIsWrittenAnew) {
  Wired wired;
  Rig rig(wired.name(), kStated);
  expect_frame(rig, 1e-3);
  wired.device.fail_next(VIDIOC_S_CTRL, ERANGE);
  const auto refused = rig.camera().trigger(2e-3, 1);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::device);
  EXPECT_THAT(refused.error().text(), HasSubstr("exposure_time_absolute"));
  expect_frame(rig, 2e-3);
}

}  // namespace
}  // namespace rig::drivers::v4l2
