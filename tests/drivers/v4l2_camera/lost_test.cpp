// A simulated video device that goes and comes back.
#include <cerrno>
#include <gmock/gmock.h>
#include <linux/videodev2.h>

#include "tests/drivers/v4l2_camera/support.h"

namespace rig::drivers::v4l2 {
namespace {

using base::ErrorCode;
using std::chrono::milliseconds;
using testing::HasSubstr;

using Device = sim::wire::V4l2Camera;

const std::string kStated = "pixel_format = \"SBGGR12\"\nmeasure_settling = false\nsettle_frames = 2\n";

class Lost : public testing::Test {
 protected:
  const std::filesystem::path path_ = socket_path();
  Device device_{path_};
};

bool is_lost(const base::Result<void>& answer) {
  return !answer && answer.error().code == ErrorCode::lost;
}

TEST_F(Lost, AnUnpluggedCameraIsLostAndComesBackAsItWas) {
  Rig rig(device_of(path_), kStated);
  expect_frame(rig, 1e-3);
  device_.unplug();
  EXPECT_TRUE(is_lost(rig.camera().trigger(2e-3, 1)));
  EXPECT_TRUE(is_lost(rig.camera().arm()));
  EXPECT_TRUE(is_lost(rig.camera().abort()));
  EXPECT_TRUE(rig.said().has("it is gone"));
  device_.plug();
  ASSERT_TRUE(eventually([&] { return rig.camera().arm().has_value(); }));
  EXPECT_TRUE(rig.said().has("it is back"));
  // As after power-up it was automatic and had YUYV.
  for (int i = 0; i < 4; ++i) expect_frame(rig, i % 2 == 0 ? 1e-3 : 5e-3);
}

TEST_F(Lost, AnExposureThatItWasAwayInIsLost) {
  Rig rig(device_of(path_), kStated);
  ASSERT_TRUE(rig.camera().trigger(20e-3, 1).has_value());
  device_.unplug();
  device_.plug();
  const auto frame = rig.wait_for_frame();
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code, ErrorCode::lost);
  ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
  expect_frame(rig, 3e-3);
}

TEST_F(Lost, WhileItIsAwayItIsTriedTwiceASecond) {
  Rig rig(device_of(path_), kStated);
  device_.unplug();
  EXPECT_TRUE(is_lost(rig.camera().abort()));
  EXPECT_TRUE(is_lost(rig.camera().abort()));  // opened in vain
  device_.plug();
  EXPECT_TRUE(is_lost(rig.camera().abort())) << "asked again too soon";
  const auto begun = std::chrono::steady_clock::now();
  ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, milliseconds(1500));
}

TEST_F(Lost, AStreamThatBreaksDownIsStartedAnew) {
  Rig rig(device_of(path_), kStated);
  for (const unsigned long request : {VIDIOC_DQBUF, VIDIOC_QBUF}) {
    expect_frame(rig, 1e-3);
    device_.fail_next(request, EIO);
    const auto frame = rig.take(2e-3);
    ASSERT_FALSE(frame.has_value());
    EXPECT_EQ(frame.error().code, ErrorCode::lost);
    ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
    expect_frame(rig, 2e-3);
  }
}

TEST_F(Lost, AStreamThatFallsSilentIsStartedAnew) {
  Rig rig(device_of(path_), kStated);
  expect_frame(rig, 1e-3);
  device_.stall();
  const auto frame = rig.take(2e-3);
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code, ErrorCode::lost);
  EXPECT_THAT(frame.error().text(), HasSubstr("it sends no frames"));
  ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
  expect_frame(rig, 2e-3);
}

TEST_F(Lost, WhatWasMeasuredHoldsForTheSameCamera) {
  Rig rig(device_of(path_), "pixel_format = \"GREY\"\nsettle_frames = 0\n");
  ASSERT_TRUE(rig.said().has("frames, measured"));
  device_.unplug();
  device_.set_light(0);
  device_.plug();
  ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
  EXPECT_FALSE(rig.said().has("could not be measured"));
  for (int i = 0; i < 4; ++i) expect_frame(rig, i % 2 == 0 ? 1e-3 : 5e-3);
}

TEST_F(Lost, ACameraThatIsNotThereIsWaitedFor) {
  device_.unplug();
  const auto clock = base::make_system_clock();
  Said said;
  const std::string who = "device = \"" + device_of(path_) + "\"\n" + kStated + "open_ms = 1000\n";
  const auto missing = V4l2Camera::open(settings_of(who), *clock, said.log());
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().code, ErrorCode::lost);
  EXPECT_THAT(missing.error().text(), HasSubstr(device_of(path_)));
  std::thread later([&] {
    std::this_thread::sleep_for(milliseconds(700));
    device_.plug();
  });
  const auto found =
      V4l2Camera::open(settings_of("device = \"" + device_of(path_) + "\"\n" + kStated), *clock, said.log());
  later.join();
  EXPECT_TRUE(found.has_value());
}

}  // namespace
}  // namespace rig::drivers::v4l2
