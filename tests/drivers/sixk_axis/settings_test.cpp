#include "drivers/sixk_axis/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"

namespace rig::drivers::sixk {
namespace {

using base::ConfigTable;
using base::radians;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kArm = R"([axis.arm]
number = 1
counts_per_deg = 200
max_velocity_deg_s = 60
max_acceleration_deg_s2 = 100
home_velocity_deg_s = 10
)";

ConfigTable parse(const std::string& text) {
  auto table = ConfigTable::parse(text, "rig.toml");
  if (!table) throw std::runtime_error(table.error().text());
  return *table;
}

std::string mistakes(const std::string& top, const std::string& axes = kArm) {
  const ConfigTable table = parse("port = \"/dev/ttyS0\"\n" + top + axes);
  (void)read_settings(table);
  const auto noted = table.finish();
  return noted ? "" : noted.error().text();
}

TEST(SixkSettings, LittleIsNeeded) {
  EXPECT_EQ(mistakes(""), "");
  const Settings settings = read_settings(parse(std::string("port = \"/dev/ttyS0\"\n") + kArm));
  EXPECT_EQ(settings.serial.baud, 9600);
  EXPECT_EQ(settings.unit, 0);
  EXPECT_EQ(settings.error_level, 4);
  EXPECT_FALSE(settings.echo);
  EXPECT_FALSE(settings.kill);
  ASSERT_EQ(settings.axes.size(), 1U);
  const ControllerAxis& axis = settings.axes[0];
  EXPECT_EQ(axis.number, 1);
  EXPECT_FALSE(axis.servo);
  EXPECT_TRUE(axis.hard_limits);
  EXPECT_FALSE(axis.encoder.has_value());
  EXPECT_FALSE(axis.home_upwards);
  EXPECT_DOUBLE_EQ(axis.home_velocity_rad_s, radians(10));
  EXPECT_DOUBLE_EQ(axis.home_acceleration_rad_s2, radians(100));
}

TEST(SixkSettings, EveryKey) {
  const std::string top = R"(baud = 19200
unit = 3
error_level = 1
echo = true
stop = "kill"
set_up = ["1HOMBAC1", "2ESTALL1"]
)";
  const std::string more = R"(motor = "stepper"
reversed = true
limit_switches = false
counts_per_turn = 36000
encoder_counts_per_deg = -50
home_towards = "high"
home_acceleration_deg_s2 = 30
home_final_velocity_deg_s = 1
preset_at_home = true
)";
  EXPECT_EQ(mistakes(top, kArm + more), "");
  const Settings settings = read_settings(parse("port = \"x\"\n" + top + kArm + more));
  EXPECT_EQ(settings.unit, 3);
  EXPECT_EQ(settings.error_level, 1);
  EXPECT_TRUE(settings.echo && settings.kill);
  EXPECT_THAT(settings.set_up, ElementsAre("1HOMBAC1", "2ESTALL1"));
  const ControllerAxis& axis = settings.axes.at(0);
  EXPECT_FALSE(axis.hard_limits);
  EXPECT_EQ(axis.resolution, 36000);
  ASSERT_TRUE(axis.encoder.has_value());
  EXPECT_NEAR(axis.encoder->counts_per_rad * radians(1), 50, 1e-9);
  EXPECT_FALSE(axis.encoder->reversed);  // against a motor that is reversed
  EXPECT_TRUE(axis.home_upwards);
  EXPECT_DOUBLE_EQ(*axis.home_final_velocity_rad_s, radians(1));
  EXPECT_TRUE(axis.preset_at_home);
}

TEST(SixkSettings, NamesEachMistake) {
  EXPECT_THAT(mistakes("error_level = 3\n"), HasSubstr("error_level"));
  EXPECT_THAT(mistakes("unit = 100\n"), HasSubstr("unit"));
  EXPECT_THAT(mistakes("stop = \"slow\"\n"), HasSubstr("stop"));
  for (const char* command : {"!1K", "3_1K", "1K:2K", "", "A\\r"}) {
    EXPECT_THAT(mistakes(std::string("set_up = [\"") + command + "\"]\n"), HasSubstr("set_up")) << command;
  }
  EXPECT_THAT(mistakes("", std::string(kArm) + "number_of = 3\n"), HasSubstr("number_of"));
  EXPECT_THAT(mistakes("", std::string(kArm) + "encoder_counts_per_deg = 0\n"), HasSubstr("encoder"));
  EXPECT_THAT(mistakes("", std::string(kArm) + "motor = \"servo\"\nencoder_counts_per_deg = 5\n"),
              HasSubstr("servo"));
  EXPECT_THAT(
      mistakes("", "[axis.arm]\ncounts_per_deg = 1\nmax_velocity_deg_s = 1\nmax_acceleration_deg_s2 = 1\n"),
      HasSubstr("number"));
  std::string twice = kArm;
  twice += "[axis.leg]\n" + twice.substr(twice.find('\n') + 1);
  EXPECT_THAT(mistakes("", twice), HasSubstr("two axes"));
}

}  // namespace
}  // namespace rig::drivers::sixk
