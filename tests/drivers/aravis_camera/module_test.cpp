// The module as rigd loads it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/loaded_module.h"

namespace rig::drivers::aravis {
namespace {

using testing::HasSubstr;

TEST(Module, IsFoundByItsNameAndOffersACamera) {
  const test::LoadedModule module("aravis_camera");
  EXPECT_THAT(module.faults_of("serial = \"1\"\npixel_format = \"Mono9\""), HasSubstr("pixel_format"));

  const auto devices =
      module.open("id = \"Fake_1\"\ntransport = \"fake\"\nname = \"eye\"\npixel_format = \"BayerRG8\"");
  ASSERT_TRUE(devices.has_value()) << devices.error().text();
  ASSERT_EQ(devices->size(), 1U);
  EXPECT_EQ(devices->front().name, "eye");
  const auto& camera = std::get<std::unique_ptr<Camera>>(devices->front().is);
  EXPECT_EQ(camera->capabilities().width, 2048);
  EXPECT_EQ(camera->capabilities().bits, 8);
  EXPECT_EQ(camera->capabilities().bayer, "RGGB");

  const auto missing = module.open("id = \"Fake_9\"\ntransport = \"fake\"\nopen_ms = 1000");
  ASSERT_FALSE(missing.has_value());
  EXPECT_THAT(missing.error().text(), HasSubstr("camera Fake_9"));
}

}  // namespace
}  // namespace rig::drivers::aravis
