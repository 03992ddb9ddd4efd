// [lines] of rig.toml: every line has one part, and says of which axis' which end it is.
#include "core/machine/lines_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/machine/rig_file.h"

namespace rig::machine {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string line_table(const std::string& part, const std::string& line,
                       const std::string& device = "lines") {
  return fmt::format("\n[{}]\nmodule = \"virtual\"\ndevice = \"{}\"\nline = \"{}\"\n", part, device, line);
}

std::string complaints(const std::string& more) {
  const auto rig = parse_rig_config(shipped_rig_text() + more, "rig.toml");
  return rig ? "no complaint" : rig.error().text();
}

// Where a text that is appended to the shipped file has its nth line.
std::string place(long line) {
  const std::string shipped = shipped_rig_text();
  return fmt::format("rig.toml:{}:", std::count(shipped.begin(), shipped.end(), '\n') + line);
}

TEST(LinesConfig, LimitLinesAreOptionalForEachEndOfEachAxis) {
  EXPECT_FALSE(rig_with({}).lines.limit[0][kLow].has_value());
  const auto rig = parse_rig_config(shipped_rig_text() + line_table("lines.limit.roll.low", "a") +
                                        line_table("lines.limit.arm.high", "b", "more"),
                                    "rig.toml");
  ASSERT_TRUE(rig.has_value()) << rig.error().text();
  EXPECT_EQ(rig->lines.limit[0][kLow]->line, "a");
  EXPECT_FALSE(rig->lines.limit[0][kHigh].has_value());
  EXPECT_EQ(rig->lines.limit[3][kHigh]->line, "b");
  EXPECT_EQ(rig->lines.limit[3][kHigh]->device, (DeviceRef{"virtual", "more"}));
  std::vector<std::string> parts;
  for (const LinePart& part : line_parts(rig->lines)) parts.push_back(part.part);
  EXPECT_THAT(parts, ElementsAre("lines.emergency_stop", "lines.limit.roll.low", "lines.limit.arm.high"));
}

TEST(LinesConfig, ADeviceOfLinesHasAShortNameWhereItIsTheOnlyOne) {
  LinesConfig lines = rig_with({}).lines;
  EXPECT_EQ(lines_name(lines, {"virtual", "lines"}), "lines");
  lines.limit[1][kHigh] = LineRef{{"io", "lines"}, "tilt_top"};
  EXPECT_EQ(lines_name(lines, {"virtual", "lines"}), "lines virtual/lines");
  EXPECT_EQ(lines_name(lines, {"io", "lines"}), "lines io/lines");
}

TEST(LinesConfig, AnAxisThatIsNotThereIsAnErrorAtItsPlace) {
  const std::string told = complaints(line_table("lines.limit.elbow.low", "a"));
  EXPECT_THAT(told, HasSubstr(place(2)));
  EXPECT_THAT(told, HasSubstr("lines.limit.elbow: there is no axis 'elbow'"));
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 0) << told;
}

TEST(LinesConfig, AnEndThatIsNotThereIsAnUnknownKey) {
  EXPECT_THAT(complaints(line_table("lines.limit.pan.lower", "a")),
              HasSubstr("lines.limit.pan.lower: unknown key (did you mean 'low'?)"));
  EXPECT_THAT(complaints("\n[lines.limit.pan]\n"), HasSubstr("lines.limit.pan: names no line"));
}

TEST(LinesConfig, ALineHasOnePart) {
  const std::string twice =
      complaints(line_table("lines.limit.pan.low", "a") + line_table("lines.limit.pan.high", "a"));
  EXPECT_THAT(twice, HasSubstr(place(10)));
  EXPECT_THAT(twice, HasSubstr("lines.limit.pan.high.line: line 'a' of device 'lines' of module 'virtual' is "
                               "that of [lines.limit.pan.low] already"));
  EXPECT_THAT(complaints(line_table("lines.limit.arm.low", "emergency_stop")),
              HasSubstr("is that of [lines.emergency_stop] already"));
  EXPECT_THAT(complaints(line_table("lines.camera_trigger", "x") + line_table("lines.limit.arm.low", "x")),
              HasSubstr("is that of [lines.camera_trigger] already"));
  EXPECT_EQ(complaints(line_table("lines.limit.arm.low", "emergency_stop", "more")), "no complaint")
      << "a line of that name of another device";
}

TEST(LinesConfig, ALimitLineNamesItsModuleDeviceAndLine) {
  EXPECT_THAT(complaints("\n[lines.limit.tilt.high]\nmodule = \"other\"\ndevice = \"lines\"\n"),
              testing::AllOf(HasSubstr("lines.limit.tilt.high.module: no [[module]] is named 'other'"),
                             HasSubstr("lines.limit.tilt.high.line: is missing")));
}

}  // namespace
}  // namespace rig::machine
