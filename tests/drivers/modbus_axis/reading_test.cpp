// Which registers are read together, and what is made of their words.
#include "drivers/modbus_axis/reading.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"

namespace rig::drivers::modbus {
namespace {

Profile profile_of(const std::string& name) {
  const auto path = find_profile(name);
  EXPECT_TRUE(path.has_value()) << path.error().text();
  const auto text = base::read_file(*path);
  EXPECT_TRUE(text.has_value());
  auto profile = parse_profile(*text, path->string());
  EXPECT_TRUE(profile.has_value()) << profile.error().text();
  return profile.value_or(Profile{});
}

OptionValues defaults(const Profile& profile) {
  OptionValues values;
  for (const Option& option : profile.options) values.push_back(option.fallback);
  return values;
}

// "holding 0x1003 x 1, ...".
std::string told(const ReadPlan& plan) {
  std::string text;
  for (const Block& block : plan.blocks) {
    text += fmt::format("{}{} 0x{:04X} x {}", text.empty() ? "" : ", ",
                        block.table == Table::input ? "input" : "holding", block.address, block.count);
  }
  return text;
}

// A drive of nobody's make, whose registers lie as a test wants them.
Profile made_up(const std::string& registers, const std::string& state) {
  const auto profile = parse_profile(fmt::format(R"(
format = 1
name = "made up"
[line]
baud = 9600
parity = "none"
word_order = "low_first"
{}
[state]
position = "position"
homed = "always"
enabled = "always"
{}
[value.position]
of = "position"
[sequence]
move = ["1 = {{position}}"]
stop = ["2 = 1"]
)",
                                                 registers, state),
                                     "made up");
  EXPECT_TRUE(profile.has_value()) << profile.error().text();
  return profile.value_or(Profile{});
}

TEST(Reading, OfLeadshineAsksForTheStatusFirst) {
  const Profile profile = profile_of("leadshine_pr");
  EXPECT_EQ(told(plan_reads(profile, defaults(profile))), "holding 0x1003 x 1, holding 0x1014 x 2");
}

TEST(Reading, OfLeadshineTellsItsStatusWords) {
  const Profile profile = profile_of("leadshine_pr");
  const OptionValues options = defaults(profile);
  const ReadPlan plan = plan_reads(profile, options);
  Reading r = decode_reading(profile, options, plan, {{0x0006}, {0xFFFF, 0xD8F0}});
  EXPECT_DOUBLE_EQ(r.position_counts, -10000);
  EXPECT_TRUE(r.enabled);
  EXPECT_FALSE(r.fault);
  EXPECT_FALSE(r.homed);
  EXPECT_EQ(r.moving, true);
  EXPECT_EQ(r.complete, false);
  r = decode_reading(profile, options, plan, {{0x0072}, {0x0000, 0x2710}});
  EXPECT_DOUBLE_EQ(r.position_counts, 10000);
  EXPECT_TRUE(r.homed);
  EXPECT_EQ(r.moving, false);
  EXPECT_EQ(r.complete, true);
}

TEST(Reading, OfOrientalReadsInputsAndOutputsTogether) {
  const Profile az = profile_of("oriental_az"), cvd = profile_of("oriental_cvd");
  EXPECT_EQ(told(plan_reads(az, defaults(az))), "holding 0x007C x 4, holding 0x00FA x 2, holding 0x00CC x 2");
  EXPECT_EQ(told(plan_reads(cvd, defaults(cvd))), "holding 0x007C x 4, holding 0x00C6 x 2");
}

TEST(Reading, OfOrientalTellsItsBits) {
  const Profile profile = profile_of("oriental_az");
  const OptionValues options = defaults(profile);
  const ReadPlan plan = plan_reads(profile, options);
  // READY, IN-POS and HOME-END; no FREE; 31.0 degrees; count -1.
  const Reading r = decode_reading(profile, options, plan, {{0, 0, 0, 0x4030}, {0, 310}, {0xFFFF, 0xFFFF}});
  EXPECT_TRUE(r.enabled);
  EXPECT_TRUE(r.homed);
  EXPECT_EQ(r.moving, false);
  EXPECT_EQ(r.complete, true);
  EXPECT_DOUBLE_EQ(r.position_counts, -1);
  EXPECT_NEAR(r.temperature_c.value_or(0), 31.0, 1e-12);
  // FREE is on, ALM-A is on.
  const Reading off = decode_reading(profile, options, plan, {{0, 0x40, 0, 0x0080}, {0, 310}, {0, 0}});
  EXPECT_FALSE(off.enabled);
  EXPECT_TRUE(off.fault);
  EXPECT_FALSE(off.homed);
}

TEST(Reading, LeavesRegistersBetweenAloneAndSplitsNoNumber) {
  const Profile profile = made_up(R"(
[register.status]
address = 10
[register.position]
address = 11
type = "i32"
[register.other]
address = 14
[register.wide]
address = 12
type = "u32"
)",
                                  R"(
fault = "other & 1"
moving = "status & 1"
complete = "wide & 1"
)");
  // 10, then 11 and 12, then 12 and 13, then 14: neighbours and overlaps are one request.
  const ReadPlan plan = plan_reads(profile, {});
  EXPECT_EQ(told(plan), "holding 0x000A x 5");
  const Reading r = decode_reading(profile, {}, plan, {{1, 0x0002, 0x0001, 0x0000, 1}});
  EXPECT_DOUBLE_EQ(r.position_counts, 0x10002);
  EXPECT_EQ(r.moving, true);
  EXPECT_EQ(r.complete, true);
  EXPECT_TRUE(r.fault);
}

TEST(Reading, KeepsTheTwoTablesApart) {
  const Profile profile = made_up(R"(
[register.status]
address = 1
table = "input"
[register.position]
address = 2
type = "i32"
)",
                                  R"(
fault = "never"
moving = "status & 1"
)");
  EXPECT_EQ(told(plan_reads(profile, {})), "input 0x0001 x 1, holding 0x0002 x 2");
}

TEST(Reading, ScalesTheReadback) {
  const Profile profile = made_up(R"(
[option.gear]
default = 4
low = 1
[register.status]
address = 1
[register.position]
address = 2
type = "i32"
scale = 0.5
times = "gear"
)",
                                  R"(
fault = "never"
moving = "status & 1"
)");
  const ReadPlan plan = plan_reads(profile, {4});
  EXPECT_EQ(told(plan), "holding 0x0001 x 3");
  EXPECT_DOUBLE_EQ(decode_reading(profile, {4}, plan, {{0, 100, 0}}).position_counts, 200);
  EXPECT_DOUBLE_EQ(decode_reading(profile, {1}, plan, {{0, 100, 0}}).position_counts, 50);
}

TEST(Reading, NamesAnAlarm) {
  const Profile profile = profile_of("oriental_az");
  EXPECT_EQ(alarm_text(profile, 0x30), "alarm 0x30: overload");
  EXPECT_THAT(alarm_text(profile, 0x99), testing::HasSubstr("0x99"));
  EXPECT_THAT(alarm_text(profile, 0x99), testing::HasSubstr("manual"));
  EXPECT_FALSE(alarm_text(profile, std::nullopt).empty());
}

}  // namespace
}  // namespace rig::drivers::modbus
