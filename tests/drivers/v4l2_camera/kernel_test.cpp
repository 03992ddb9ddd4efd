// The driver on a video device of the kernel: vivid, the kernel's virtual one, at the path in
// RIG_V4L2_DEVICE. It has no exposure control; its brightness stands in for a gain. tests/kernel runs this in
// its machine.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <gmock/gmock.h>
#include <linux/videodev2.h>
#include <numeric>

#include "drivers/v4l2_camera/controls.h"
#include "drivers/v4l2_camera/video_node.h"
#include "tests/drivers/v4l2_camera/support.h"

namespace rig::drivers::v4l2 {
namespace {

using base::ErrorCode;
using testing::HasSubstr;

std::string device() {
  const char* path = std::getenv("RIG_V4L2_DEVICE");
  return path == nullptr ? "" : path;
}

// Its controls, by a second opening. A button is pressed by any value.
class Knobs {
 public:
  Knobs() {
    auto opened = open_node(device());
    if (!opened) throw std::runtime_error(opened.error().text());
    node_ = std::move(*opened);
    controls_ = list_controls(*node_).value();
  }
  [[nodiscard]] int try_to_set(const std::string& name, std::int32_t value) {
    const auto found =
        std::find_if(controls_.begin(), controls_.end(), [&](const Control& c) { return c.name == name; });
    if (found == controls_.end()) return ENOENT;
    v4l2_control wanted{};
    wanted.id = found->id;
    wanted.value = value;
    return node_->request(VIDIOC_S_CTRL, &wanted);
  }
  void set(const std::string& name, std::int32_t value = 1) { EXPECT_EQ(try_to_set(name, value), 0) << name; }

 private:
  std::unique_ptr<VideoNode> node_;
  std::vector<Control> controls_;
};

const std::string kSettings =
    "width = 320\nheight = 180\nframe_interval_ms = 100\nfixed_exposure_ms = 20\ngain_control = "
    "\"contrast\"\n"
    "gain_unit = \"factor\"\ngain_counts = 64\nexclusive = false\n";
constexpr double kExposure_s = 20e-3;
constexpr auto kPatience = std::chrono::seconds(30);

class KernelVivid : public testing::Test {
 protected:
  void SetUp() override {
    if (device().empty()) GTEST_SKIP() << "RIG_V4L2_DEVICE names no device";
    Knobs knobs;
    knobs.set("osd_text_mode", 2);  // nothing is written into the picture
    knobs.set("timestamp_source", 0);
    knobs.set("percentage_of_dropped_buffers", 0);
  }

  // The mean sample as a share of the largest.
  static double level(Rig& rig) {
    const auto& pixels = rig.pixels();
    const double sum = std::accumulate(pixels.begin(), pixels.end(), 0.0);
    return sum / static_cast<double>(pixels.size()) / ((1 << rig.capabilities().bits) - 1);
  }

  static double take(Rig& rig, double gain) {
    if (const auto begun = rig.camera().trigger(kExposure_s, gain); !begun) {
      ADD_FAILURE() << begun.error().text();
      return -1;
    }
    const auto frame = rig.wait_for_frame(kPatience);
    EXPECT_TRUE(frame.has_value()) << frame.error().text();
    if (frame && !frame->has_value()) ADD_FAILURE() << "no frame came";
    return level(rig);
  }

  // Levels of two gains, each long after it was set, and then many in turns: each is its own.
  static void expect_own_frames(Rig& rig, int frames) {
    std::array<double, 2> levels{};
    const std::array<double, 2> gains{1, 3};
    for (std::size_t i = 0; i < 2; ++i) {
      for (int n = 0; n < 10; ++n) levels.at(i) = take(rig, gains.at(i));
    }
    ASSERT_GT(levels[1] - levels[0], 0.1) << "the contrast does not show";
    for (int i = 0; i < frames; ++i) {
      const std::size_t which = static_cast<std::size_t>(i) % 2;
      EXPECT_NEAR(take(rig, gains.at(which)), levels.at(which), 0.005) << "frame " << i;
    }
  }

  static void expect_back(Rig& rig) {
    ASSERT_TRUE(eventually([&] { return rig.camera().arm().has_value(); }, kPatience));
    const double dark = take(rig, 1), bright = take(rig, 3);
    EXPECT_GT(bright - dark, 0.1);
  }
};

TEST_F(KernelVivid, EveryFormatShowsTheSamePicture) {
  std::optional<double> grey;
  for (const char* name : {"GREY",    "Y10",     "Y12",     "Y16",     "SRGGB8",  "SGRBG8",  "SGBRG8",
                           "SBGGR8",  "SRGGB10", "SGRBG10", "SGBRG10", "SBGGR10", "SRGGB12", "SGRBG12",
                           "SGBRG12", "SBGGR12", "SRGGB16", "SGRBG16", "SGBRG16", "SBGGR16"}) {
    SCOPED_TRACE(name);
    Rig rig(device(), fmt::format("pixel_format = \"{}\"\nmeasure_settling = false\n", name) + kSettings);
    ASSERT_EQ(rig.capabilities().width, 320);
    ASSERT_EQ(rig.capabilities().height, 180);
    const double shows = take(rig, 2);
    const int most = (1 << rig.capabilities().bits) - 1;
    EXPECT_LE(*std::max_element(rig.pixels().begin(), rig.pixels().end()), most);
    // Mosaics of one scene have the mean of its colours, whatever their order.
    const bool is_grey = std::string(name).find("RG") == std::string::npos &&
                         std::string(name).find("BG") == std::string::npos;
    if (is_grey && !grey) grey = shows;
    if (is_grey) {
      EXPECT_NEAR(shows, *grey, 0.01);
    } else {
      EXPECT_NEAR(shows, *grey, 0.15);
    }
    EXPECT_GT(shows, 0.05);
  }
}

TEST_F(KernelVivid, AGainShowsInItsFramesAndInNoOther) {
  for (const int source : {0, 1}) {
    Knobs().set("timestamp_source", source);
    SCOPED_TRACE(source == 0 ? "stamps of the end" : "stamps of the start");
    Rig rig(device(), "pixel_format = \"GREY\"\nsettle_frames = 0\n" + kSettings);
    EXPECT_TRUE(rig.said().has("frames, measured")) << "the settling was not measured";
    expect_own_frames(rig, 16);
  }
}

TEST_F(KernelVivid, DamagedFramesArePassedOver) {
  Rig rig(device(), "pixel_format = \"Y12\"\nmeasure_settling = false\nsettle_frames = 1\n" + kSettings);
  const double dark = take(rig, 1), bright = take(rig, 3);
  for (int i = 0; i < 6; ++i) {
    Knobs().set("inject_v4l2_buf_flag_error");
    EXPECT_NEAR(take(rig, i % 2 == 0 ? 1 : 3), i % 2 == 0 ? dark : bright, 0.005);
  }
  EXPECT_TRUE(rig.said().has("damaged on their way"));
}

TEST_F(KernelVivid, DroppedFramesAreCountedAndReplaced) {
  Rig rig(device(), "pixel_format = \"SBGGR12\"\nmeasure_settling = false\nsettle_frames = 1\n" + kSettings);
  const double dark = take(rig, 1), bright = take(rig, 3);
  Knobs().set("percentage_of_dropped_buffers", 40);
  std::uint64_t last = 0;
  for (int i = 0; i < 12; ++i) {
    ASSERT_TRUE(rig.camera().trigger(kExposure_s, i % 2 == 0 ? 1 : 3).has_value());
    const auto frame = rig.wait_for_frame(kPatience);
    ASSERT_TRUE(frame.has_value() && frame->has_value());
    EXPECT_GT((*frame)->counter, last);
    last = (*frame)->counter;
    EXPECT_NEAR(level(rig), i % 2 == 0 ? dark : bright, 0.005);
  }
  EXPECT_TRUE(rig.said().has("were lost"));
}

TEST_F(KernelVivid, AStreamThatBreaksDownIsStartedAnew) {
  Rig rig(device(), "pixel_format = \"GREY\"\nmeasure_settling = false\nsettle_frames = 1\n" + kSettings);
  (void)take(rig, 1);
  ASSERT_TRUE(rig.camera().trigger(kExposure_s, 3).has_value());
  {
    Knobs knobs;
    knobs.set("inject_fatal_streaming_error");
    knobs.set("inject_vidioc_streamon_error");  // and once more
  }
  const auto frame = rig.wait_for_frame(kPatience);
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code, ErrorCode::lost);
  expect_back(rig);
}

TEST_F(KernelVivid, ADisconnectedCameraIsLostAndComesBack) {
  Rig rig(device(), "pixel_format = \"Y16\"\nmeasure_settling = false\nsettle_frames = 1\n" + kSettings);
  (void)take(rig, 1);
  ASSERT_TRUE(rig.camera().trigger(kExposure_s, 3).has_value());
  // It is there again once nobody has it open.
  Knobs().set("disconnect");
  const auto frame = rig.wait_for_frame(kPatience);
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code, ErrorCode::lost);
  EXPECT_THAT(frame.error().text(), HasSubstr("it is gone"));
  expect_back(rig);
}

TEST_F(KernelVivid, WhatItCannotDoIsRefusedAndASecondProgramToo) {
  const auto clock = base::make_system_clock();
  Said said;
  const auto open = [&](const std::string& format) {
    const std::string who = "device = \"" + device() + "\"\nopen_ms = 1000\nmeasure_settling = false\n";
    return V4l2Camera::open(settings_of(who + "pixel_format = \"" + format + "\"\nfixed_exposure_ms = 20"),
                            *clock, said.log());
  };
  const auto missing = open("SRGGB14");
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().code, ErrorCode::bad_input);
  EXPECT_THAT(missing.error().text(), HasSubstr("it has YUYV (not raw)"));
  const auto first = open("GREY");
  ASSERT_TRUE(first.has_value()) << first.error().text();
  const auto second = open("GREY");
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, ErrorCode::busy);
  EXPECT_EQ(Knobs().try_to_set("contrast", 7), EBUSY) << "the controls are ours alone";
}

}  // namespace
}  // namespace rig::drivers::v4l2
