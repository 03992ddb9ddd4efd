// The module as rigd loads it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/host/module_loader.h"
#include "tests/drivers/v4l2_camera/support.h"

namespace rig::drivers::v4l2 {
namespace {

using testing::HasSubstr;

TEST(Module, IsFoundByItsNameAndOffersACamera) {
  const auto entry = load_module("v4l2_camera", {RIG_BINARY_DIR "/lib"});
  ASSERT_TRUE(entry.has_value()) << entry.error().text();
  EXPECT_STREQ((*entry)->name, "v4l2_camera");

  const auto wrong = base::ConfigTable::parse("device = \"/dev/video0\"\npixel_format = \"Y9\"", "rig.toml");
  ASSERT_TRUE(wrong.has_value());
  (*entry)->check(*wrong);
  ASSERT_FALSE(wrong->noted().has_value());
  EXPECT_THAT(wrong->noted().error().text(), HasSubstr("pixel_format"));

  const auto clock = base::make_system_clock();
  const auto path = socket_path();
  const auto settings = [&](const std::string& more) {
    return base::ConfigTable::parse("device = \"" + device_of(path) + "\"\nname = \"eye\"\n" + more,
                                    "rig.toml");
  };
  {
    const sim::wire::V4l2Camera device(path);
    const auto table = settings("pixel_format = \"SRGGB12P\"");
    ASSERT_TRUE(table.has_value());
    const auto devices = (*entry)->open({"v4l2", *table, "", *clock, nullptr});
    ASSERT_TRUE(devices.has_value()) << devices.error().text();
    ASSERT_EQ(devices->size(), 1U);
    EXPECT_EQ(devices->front().name, "eye");
    const auto& camera = std::get<std::unique_ptr<Camera>>(devices->front().is);
    EXPECT_EQ(camera->capabilities().width, 64);
    EXPECT_EQ(camera->capabilities().bits, 12);
    EXPECT_EQ(camera->capabilities().bayer, "RGGB");
    EXPECT_FALSE(camera->capabilities().overlaps_motion);
  }
  const auto nobody = settings("pixel_format = \"GREY\"\nopen_ms = 1000");
  ASSERT_TRUE(nobody.has_value());
  const auto missing = (*entry)->open({"v4l2", *nobody, "", *clock, nullptr});
  ASSERT_FALSE(missing.has_value());
  EXPECT_THAT(missing.error().text(), HasSubstr("nobody plays a camera there"));
}

}  // namespace
}  // namespace rig::drivers::v4l2
