// Settings: what is wrong is said with its key, and what is right becomes what it says.
#include "drivers/cia402_axis/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "tests/drivers/cia402_axis/rig.h"

namespace rig::drivers::cia402 {
namespace {

using testing::HasSubstr;

Settings good(const std::string& text) {
  const auto table = base::ConfigTable::parse(text, "rig.toml");
  EXPECT_TRUE(table.has_value()) << table.error().text();
  const Settings settings = read_settings(*table);
  const auto finished = table->finish();
  EXPECT_TRUE(finished.has_value()) << finished.error().text();
  return settings;
}

std::string faults(const std::string& text) {
  const auto table = base::ConfigTable::parse(text, "rig.toml");
  EXPECT_TRUE(table.has_value()) << table.error().text();
  (void)read_settings(*table);
  const auto finished = table->finish();
  return finished ? std::string() : finished.error().text();
}

TEST(Settings, TheUsualOnes) {
  const Settings settings = good(settings_text("can0"));
  EXPECT_EQ(settings.network.interface, "can0");
  EXPECT_EQ(settings.network.heartbeat.count(), 100);
  EXPECT_EQ(settings.network.heartbeat_timeout.count(), 300);
  ASSERT_EQ(settings.drives.size(), 1U);
  const DriveSettings& drive = settings.drives[0];
  EXPECT_EQ(drive.axis.name, "pan");
  EXPECT_EQ(drive.node, 1);
  EXPECT_EQ(drive.reference, Reference::homing_mode);
  ASSERT_TRUE(drive.homing);
  EXPECT_EQ(drive.homing->method, 17);
  EXPECT_NEAR(drive.homing->creep_rad_s, base::radians(20), 1e-12);
  EXPECT_EQ(drive.quick_stop_option, 6);
  EXPECT_NEAR(drive.quick_stop_rad_s2, base::radians(3000), 1e-9);
}

TEST(Settings, AnAbsoluteEncoderNeedsNoHoming) {
  const Settings settings = good(R"(interface = "can0"
[axis.pan]
node = 5
counts_per_deg = 100
max_velocity_deg_s = 10
max_acceleration_deg_s2 = 20
keeps_reference = true
)");
  EXPECT_EQ(settings.drives.at(0).reference, Reference::absolute);
  EXPECT_FALSE(settings.drives.at(0).homing);
}

TEST(Settings, AMakersBitTellsTheReference) {
  const Settings settings =
      good(settings_text("can0", "", "homed_by = \"statusword_bit\"\nreferenced_bit = 15"));
  EXPECT_EQ(settings.drives.at(0).reference, Reference::statusword_bit);
  EXPECT_EQ(settings.drives.at(0).referenced_bit, 15);
}

TEST(Settings, WhatIsWrongIsNamed) {
  const struct {
    std::string module, axis;
    const char *key, *rule;
  } cases[] = {
      {"call_ms = 200", "", "call_ms", "3 attempts of 100 ms"},
      {"heartbeat_ms = 500\nheartbeat_timeout_ms = 500", "", "heartbeat_timeout_ms",
       "more than heartbeat_ms"},
      {"", "quick_stop_option = 4", "quick_stop_option", "no option"},
      {"", "homed_by = \"guess\"", "homed_by", "session"},
      {"", "homed_by = \"statusword_bit\"\nreferenced_bit = 10", "referenced_bit", "8, 14 or 15"},
      {"", "homed_by = \"session\"\nkeeps_reference = true", "homed_by", "always homed"},
      {"", "nodes = 3", "nodes", "unknown"},
  };
  for (const auto& one : cases) {
    const std::string text = faults(settings_text("can0", one.module, one.axis));
    EXPECT_THAT(text, HasSubstr(one.key));
    EXPECT_THAT(text, HasSubstr(one.rule));
    EXPECT_THAT(text, HasSubstr("rig.toml:"));
  }
  EXPECT_THAT(faults(settings_text("")), HasSubstr("interface"));
  EXPECT_THAT(faults("interface = \"can0\""), HasSubstr("no axis"));
}

TEST(Settings, TwoAxesOnOneNodeAreRefused) {
  std::string second = settings_text("can0");
  second = second.substr(second.find("[axis.pan]"));
  second.replace(0, 10, "[axis.tilt]");
  const std::string text = faults(settings_text("can0") + second);
  EXPECT_THAT(text, HasSubstr("node 1 is axis pan already"));
}

TEST(Settings, MethodZeroAndNoMethodAreRefused) {
  std::string text = settings_text("can0");
  const auto at = text.find("homing_method = 17");
  EXPECT_THAT(faults(std::string(text).replace(at, 18, "homing_method = 0")), HasSubstr("no method"));
  EXPECT_THAT(faults(std::string(text).replace(at, 18, "")), HasSubstr("homing_method"));
}

}  // namespace
}  // namespace rig::drivers::cia402
