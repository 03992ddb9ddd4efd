// The module as rigd loads it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/host/module_loader.h"
#include "tests/drivers/aravis_camera/support.h"

namespace rig::drivers::aravis {
namespace {

using testing::HasSubstr;

TEST(Module, IsFoundByItsNameAndOffersACamera) {
  const auto entry = load_module("aravis_camera", {RIG_BINARY_DIR "/lib"});
  ASSERT_TRUE(entry.has_value()) << entry.error().text();
  EXPECT_STREQ((*entry)->name, "aravis_camera");

  const auto wrong = base::ConfigTable::parse("serial = \"1\"\npixel_format = \"Mono9\"", "rig.toml");
  ASSERT_TRUE(wrong.has_value());
  (*entry)->check(*wrong);
  ASSERT_FALSE(wrong->noted().has_value());
  EXPECT_THAT(wrong->noted().error().text(), HasSubstr("pixel_format"));

  const auto clock = base::make_system_clock();
  const auto table = base::ConfigTable::parse(
      "id = \"Fake_1\"\ntransport = \"fake\"\nname = \"eye\"\npixel_format = \"BayerRG8\"", "rig.toml");
  ASSERT_TRUE(table.has_value());
  const auto devices = (*entry)->open({"aravis", *table, "", *clock, nullptr});
  ASSERT_TRUE(devices.has_value()) << devices.error().text();
  ASSERT_EQ(devices->size(), 1U);
  EXPECT_EQ(devices->front().name, "eye");
  const auto& camera = std::get<std::unique_ptr<Camera>>(devices->front().is);
  EXPECT_EQ(camera->capabilities().width, 2048);
  EXPECT_EQ(camera->capabilities().bits, 8);
  EXPECT_EQ(camera->capabilities().bayer, "RGGB");

  const auto nobody =
      base::ConfigTable::parse("id = \"Fake_9\"\ntransport = \"fake\"\nopen_ms = 1000", "rig.toml");
  ASSERT_TRUE(nobody.has_value());
  const auto missing = (*entry)->open({"aravis", *nobody, "", *clock, nullptr});
  ASSERT_FALSE(missing.has_value());
  EXPECT_THAT(missing.error().text(), HasSubstr("camera Fake_9"));
}

}  // namespace
}  // namespace rig::drivers::aravis
