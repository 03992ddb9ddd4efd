// The module through its door, as rigd opens it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/host/module_loader.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::sixk {
namespace {

using base::ConfigTable;
using base::ErrorCode;
using ::testing::HasSubstr;

void no_log(base::LogLevel, std::string_view) {}

class SixkModule : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto loaded = load_module(RIG_BINARY_DIR "/lib/librig_driver_sixk_axis.so", {});
    ASSERT_TRUE(loaded.has_value()) << loaded.error().text();
    entry_ = *loaded;
  }

  const ModuleEntry* entry_ = nullptr;
};

TEST_F(SixkModule, ChecksItsSettings) {
  EXPECT_STREQ(entry_->name, "sixk_axis");
  const auto table = ConfigTable::parse("port = 3\nbaud = 1\n[axis.pan]\n", "rig.toml");
  ASSERT_TRUE(table.has_value());
  entry_->check(*table);
  const auto noted = table->noted();
  ASSERT_FALSE(noted.has_value());
  for (const char* key : {"port", "baud", "max_velocity_deg_s"})
    EXPECT_THAT(noted.error().text(), HasSubstr(key));
}

TEST_F(SixkModule, AnAbsentLineIsLost) {
  test::TemporaryFolder folder;
  const auto table = ConfigTable::parse("port = \"" + (folder / "nowhere").string() + R"("
[axis.pan]
max_velocity_deg_s = 10
max_acceleration_deg_s2 = 10
number = 1
counts_per_deg = 100
home_velocity_deg_s = 5)",
                                        "rig.toml");
  ASSERT_TRUE(table.has_value());
  const auto clock = base::make_system_clock();
  const auto devices = entry_->open({"head", *table, folder.path(), *clock, &no_log});
  ASSERT_FALSE(devices.has_value());
  EXPECT_EQ(devices.error().code, ErrorCode::lost);
  EXPECT_THAT(devices.error().text(), HasSubstr("plugged in"));
}

}  // namespace
}  // namespace rig::drivers::sixk
