// The module as rigd loads it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/loaded_module.h"
#include "tests/drivers/v4l2_camera/support.h"

namespace rig::drivers::v4l2 {
namespace {

using testing::HasSubstr;

TEST(Module, IsFoundByItsNameAndOffersACamera) {
  const test::LoadedModule module("v4l2_camera");
  EXPECT_THAT(module.faults_of("device = \"/dev/video0\"\npixel_format = \"Y9\""), HasSubstr("pixel_format"));

  const auto path = socket_path();
  const std::string who = "device = \"" + device_of(path) + "\"\nname = \"eye\"\n";
  {
    const sim::wire::V4l2Camera device(path);
    const auto devices = module.open(who + "pixel_format = \"SRGGB12P\"");
    ASSERT_TRUE(devices.has_value()) << devices.error().text();
    ASSERT_EQ(devices->size(), 1U);
    EXPECT_EQ(devices->front().name, "eye");
    const auto& camera = std::get<std::unique_ptr<Camera>>(devices->front().is);
    EXPECT_EQ(camera->capabilities().width, 64);
    EXPECT_EQ(camera->capabilities().bits, 12);
    EXPECT_EQ(camera->capabilities().bayer, "RGGB");
    EXPECT_FALSE(camera->capabilities().overlaps_motion);
  }
  const auto missing = module.open(who + "pixel_format = \"GREY\"\nopen_ms = 1000");
  ASSERT_FALSE(missing.has_value());
  EXPECT_THAT(missing.error().text(), HasSubstr("nobody plays a camera there"));
}

}  // namespace
}  // namespace rig::drivers::v4l2
