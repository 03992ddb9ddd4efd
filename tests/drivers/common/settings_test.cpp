#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/units.h"
#include "drivers/common/axis_settings.h"
#include "drivers/common/retry.h"
#include "drivers/common/serial_line.h"

namespace rig::drivers {
namespace {

using base::ConfigTable;
using base::radians;
using ::testing::HasSubstr;

ConfigTable parse(std::string_view text) {
  auto table = ConfigTable::parse(text, "rig.toml");
  if (!table) throw std::runtime_error(table.error().text());
  return *table;
}

std::string mistakes(const ConfigTable& table) {
  const auto noted = table.finish();
  return noted ? "" : noted.error().text();
}

TEST(AxisSettings, ReadsEveryKey) {
  const ConfigTable table = parse(R"(counts_per_deg = 200
reversed = true
zero_deg = -45.0
max_velocity_deg_s = 20.0
max_acceleration_deg_s2 = 40.0
)");
  const AxisSettings axis = read_axis_settings("tilt", table);
  EXPECT_EQ(mistakes(table), "");
  EXPECT_EQ(axis.name, "tilt");
  EXPECT_NEAR(axis.scale.counts_per_rad * radians(1), 200, 1e-9);
  EXPECT_TRUE(axis.scale.reversed);
  EXPECT_DOUBLE_EQ(axis.scale.zero_rad, radians(-45));
  EXPECT_DOUBLE_EQ(axis.max_velocity_rad_s, radians(20));
  EXPECT_DOUBLE_EQ(axis.max_acceleration_rad_s2, radians(40));
}

TEST(AxisSettings, WhatMayBeLeftOut) {
  const ConfigTable table = parse("max_velocity_deg_s = 1\nmax_acceleration_deg_s2 = 1\n");
  const AxisSettings axis = read_axis_settings("pan", table, true);
  EXPECT_EQ(mistakes(table), "");
  EXPECT_FALSE(axis.scale.reversed);
  EXPECT_EQ(axis.scale.zero_rad, 0);
}

TEST(AxisSettings, NamesEachMistake) {
  const ConfigTable table =
      parse("counts_per_deg = 0\nzero_deg = 400\nmax_acceleration_deg_s2 = 1\nspeed = 1\n");
  (void)read_axis_settings("pan", table);
  const std::string text = mistakes(table);
  EXPECT_THAT(text, HasSubstr("counts_per_deg"));
  EXPECT_THAT(text, HasSubstr("zero_deg"));
  EXPECT_THAT(text, HasSubstr("max_velocity_deg_s"));
  EXPECT_THAT(text, HasSubstr("speed"));
}

TEST(AxisTables, ComeInTheOrderOfTheFile) {
  const ConfigTable table = parse("[axis.tilt]\n[axis.pan]\n");
  const auto axes = axis_tables(table);
  ASSERT_EQ(axes.size(), 2U);
  EXPECT_EQ(axes[0].first, "tilt");
  EXPECT_EQ(axes[1].first, "pan");
}

TEST(AxisTables, NoneIsAMistake) {
  const ConfigTable table = parse("[axis]\n");
  EXPECT_TRUE(axis_tables(table).empty());
  EXPECT_THAT(mistakes(table), HasSubstr("no axis"));
}

TEST(RetrySettings, AreReadWithinTheirBounds) {
  const ConfigTable given = parse("attempts = 5\nanswer_ms = 40\n");
  const RetryPolicy policy = read_retry_policy(given);
  EXPECT_EQ(policy.attempts, 5);
  EXPECT_EQ(policy.answer.count(), 40);
  EXPECT_EQ(policy.longest().count(), 200);
  const RetryPolicy usual = read_retry_policy(parse(""));
  EXPECT_EQ(usual.attempts, 3);
  EXPECT_EQ(usual.answer.count(), 200);
  EXPECT_EQ(usual.call.count(), 800);
  const ConfigTable wrong = parse("attempts = 0\nanswer_ms = 0\n");
  (void)read_retry_policy(wrong);
  EXPECT_THAT(mistakes(wrong), HasSubstr("attempts"));
  EXPECT_THAT(mistakes(wrong), HasSubstr("answer_ms"));
}

TEST(RetrySettings, ACallHasTimeForOneQuestion) {
  EXPECT_EQ(read_retry_policy(parse("call_ms = 600\n")).call.count(), 600);
  for (const char* text : {"call_ms = 599\n", "answer_ms = 300\n", "attempts = 5\n"}) {
    const ConfigTable table = parse(text);
    (void)read_retry_policy(table);
    EXPECT_THAT(mistakes(table), HasSubstr("call_ms")) << text;
  }
}

TEST(SerialSettings, AreReadOverTheUsualOnes) {
  const ConfigTable given = parse("port = \"/dev/ttyUSB0\"\nbaud = 19200\nparity = \"odd\"\nstop_bits = 2\n");
  const SerialSettings serial = read_serial_settings(given, {"", 9600, 'E', 1});
  EXPECT_EQ(mistakes(given), "");
  EXPECT_EQ(serial.path, "/dev/ttyUSB0");
  EXPECT_EQ(serial.baud, 19200);
  EXPECT_EQ(serial.parity, 'O');
  EXPECT_EQ(serial.stop_bits, 2);
  const SerialSettings usual = read_serial_settings(parse("port = \"x\"\n"), {"", 38400, 'E', 2});
  EXPECT_EQ(usual.baud, 38400);
  EXPECT_EQ(usual.parity, 'E');
  EXPECT_EQ(usual.stop_bits, 2);
}

TEST(SerialSettings, ASpeedThatNoLineRunsAtIsAMistake) {
  const ConfigTable table = parse("port = \"x\"\nbaud = 9601\n");
  (void)read_serial_settings(table, {});
  EXPECT_THAT(mistakes(table), HasSubstr("9601"));
}

}  // namespace
}  // namespace rig::drivers
