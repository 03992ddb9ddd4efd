#include "drivers/ptu_axis/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"

namespace rig::drivers::ptu {
namespace {

using base::ConfigTable;
using base::radians;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kPan = R"(
[axis.pan]
max_velocity_deg_s = 60
max_acceleration_deg_s2 = 100
)";

ConfigTable parse(const std::string& text) {
  auto table = ConfigTable::parse(text, "rig.toml");
  if (!table) throw std::runtime_error(table.error().text());
  return *table;
}

std::string mistakes(const std::string& text) {
  const ConfigTable table = parse(text);
  (void)read_settings(table);
  const auto noted = table.finish();
  return noted ? "" : noted.error().text();
}

TEST(PtuSettings, LittleIsNeeded) {
  const std::string text = std::string("port = \"/dev/ttyS0\"\n") + kPan;
  EXPECT_EQ(mistakes(text), "");
  const Settings settings = read_settings(parse(text));
  EXPECT_EQ(settings.serial.path, "/dev/ttyS0");
  EXPECT_EQ(settings.serial.baud, 9600);
  EXPECT_EQ(settings.serial.parity, 'N');
  ASSERT_EQ(settings.axes.size(), 1U);
  EXPECT_EQ(settings.axes[0].letter, 'P');
  EXPECT_EQ(settings.limits, Limits::factory);
  EXPECT_EQ(settings.reset, Reset::both);
  EXPECT_EQ(settings.reset_within, std::chrono::seconds(30));
  EXPECT_FALSE(settings.low_hold_power);
}

TEST(PtuSettings, EveryKey) {
  const std::string text = R"(port = "/dev/ttyS0"
baud = 19200
attempts = 2
answer_ms = 300
limits = "user"
reset = "axis"
hold_power = "low"
reset_s = 60
tables_s = 5
[axis.tilt]
counts_per_deg = 19.4444
reversed = true
zero_deg = 10
max_velocity_deg_s = 60
max_acceleration_deg_s2 = 100
base_velocity_deg_s = 3
user_min_deg = -60
user_max_deg = 30
)";
  EXPECT_EQ(mistakes(text), "");
  const Settings settings = read_settings(parse(text));
  EXPECT_EQ(settings.limits, Limits::user);
  EXPECT_EQ(settings.reset, Reset::axis);
  EXPECT_TRUE(settings.low_hold_power);
  EXPECT_EQ(settings.tables_within, std::chrono::seconds(5));
  EXPECT_EQ(settings.retry.attempts, 2);
  const UnitAxis& axis = settings.axes.at(0);
  EXPECT_EQ(axis.letter, 'T');
  EXPECT_EQ(axis.counts_per_deg, 19.4444);
  EXPECT_TRUE(axis.axis.scale.reversed);
  EXPECT_DOUBLE_EQ(*axis.base_velocity_rad_s, radians(3));
  EXPECT_DOUBLE_EQ(axis.user_min_rad, radians(-60));
  EXPECT_DOUBLE_EQ(axis.user_max_rad, radians(30));
}

TEST(PtuSettings, NamesEachMistake) {
  EXPECT_THAT(mistakes(kPan), HasSubstr("port"));
  EXPECT_THAT(mistakes("port = \"x\"\n"), HasSubstr("axis"));
  EXPECT_THAT(mistakes(std::string("port = \"x\"\nlimits = \"none\"\n") + kPan), HasSubstr("limits"));
  EXPECT_THAT(mistakes(std::string("port = \"x\"\nreset = \"R\"\n") + kPan), HasSubstr("reset"));
  EXPECT_THAT(mistakes(std::string("port = \"x\"\n") + kPan + "speed = 3\n"), HasSubstr("speed"));
  EXPECT_THAT(mistakes("port = \"x\"\n[axis.roll]\nmax_velocity_deg_s = 1\nmax_acceleration_deg_s2 = 1\n"),
              AllOf(HasSubstr("roll"), HasSubstr("pan and tilt")));
}

TEST(PtuSettings, UserLimitsBelongTogether) {
  const std::string user = std::string("port = \"x\"\nlimits = \"user\"\n") + kPan;
  EXPECT_THAT(mistakes(user), AllOf(HasSubstr("user_min_deg"), HasSubstr("user_max_deg")));
  EXPECT_THAT(mistakes(user + "user_min_deg = 10\nuser_max_deg = 10\n"), HasSubstr("no travel"));
  EXPECT_THAT(mistakes(std::string("port = \"x\"\n") + kPan + "user_min_deg = 10\n"),
              HasSubstr("user_min_deg"));
}

}  // namespace
}  // namespace rig::drivers::ptu
