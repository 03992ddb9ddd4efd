// A simulated GigE Vision camera that goes and comes back, or obeys somebody else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "tests/drivers/aravis_camera/support.h"

namespace rig::drivers::aravis {
namespace {

using base::ErrorCode;
using std::chrono::milliseconds;

using GigeLost = Gige;

TEST_F(GigeLost, AVanishedCameraIsLostAndComesBackAsItWas) {
  auto camera = start_camera();
  Rig rig(kGige + "pixel_format = \"BayerRG12\"\n");
  expect_frame(rig, 1e-3);
  ASSERT_TRUE(camera.command("vanish"));
  const auto begun = std::chrono::steady_clock::now();
  const auto gone = rig.camera().trigger(2e-3, 1);
  ASSERT_FALSE(gone.has_value());
  EXPECT_EQ(gone.error().code, ErrorCode::lost);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, milliseconds(2500))
      << "no call waits for Aravis, which takes as long and longer";
  EXPECT_EQ(rig.camera().abort().error().code, ErrorCode::lost);
  EXPECT_EQ(rig.camera().temperature_c().error().code, ErrorCode::lost);
  ASSERT_TRUE(camera.command("return"));
  ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
  // As after power-up it had 512 x 512 pixels of Mono8.
  ASSERT_TRUE(rig.camera().arm().has_value());
  expect_frame(rig, 3e-3);
}

TEST_F(GigeLost, LostWhileItWaitsForAPulseIsSaidByFetch) {
  auto camera = start_camera();
  Rig rig(kGige + "trigger_line = \"Line0\"\n");
  expect_frame(rig, 1e-3);
  ASSERT_TRUE(rig.camera().await_trigger(2e-3, 1).has_value());
  ASSERT_TRUE(camera.command("vanish"));
  base::Result<std::optional<FrameInfo>> answer;
  ASSERT_TRUE(eventually([&] {
    answer = rig.camera().fetch(rig.pixels());
    return !answer.has_value();
  }));
  EXPECT_EQ(answer.error().code, ErrorCode::lost);
  ASSERT_TRUE(camera.command("return"));
  ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
  expect_frame(rig, 3e-3);
}

// It was away and is back before anybody asked: its frame is not waited for.
TEST_F(GigeLost, AnExposureThatItWasAwayInIsLost) {
  auto camera = start_camera();
  Rig rig(kGige + "trigger_line = \"Line0\"\n");
  ASSERT_TRUE(rig.camera().await_trigger(1e-3, 1).has_value());
  ASSERT_TRUE(camera.command("vanish"));
  ASSERT_TRUE(camera.command("return"));
  base::Result<std::optional<FrameInfo>> answer;
  ASSERT_TRUE(eventually([&] {
    answer = rig.camera().fetch(rig.pixels());
    return !answer.has_value();
  }));
  EXPECT_EQ(answer.error().code, ErrorCode::lost);
  ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
  expect_frame(rig, 2e-3);
}

TEST_F(GigeLost, LosingControlIsBeingLost) {
  auto camera = start_camera();
  Rig rig(kGige);
  expect_frame(rig, 1e-3);
  ASSERT_TRUE(camera.command("drop-control"));
  // The heartbeat sees it within two seconds; then the driver takes control again.
  ASSERT_TRUE(eventually([&] {
    const auto answer = rig.camera().abort();
    return !answer.has_value() && answer.error().code == ErrorCode::lost;
  }));
  ASSERT_TRUE(eventually([&] { return rig.camera().abort().has_value(); }));
  expect_frame(rig, 2e-3);
}

}  // namespace
}  // namespace rig::drivers::aravis
