// What a module's settings mean, and that each mistake names its key.
#include "drivers/gpiod_lines/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rig::drivers::gpiod_lines {
namespace {

using testing::HasSubstr;

LinesSettings read(const std::string& text) {
  const auto table = base::ConfigTable::parse(text, "rig.toml").value();
  LinesSettings settings = read_lines_settings(table);
  const auto fine = table.finish();
  EXPECT_TRUE(fine) << fine.error().text();
  return settings;
}

std::string mistakes(const std::string& text) {
  const auto table = base::ConfigTable::parse(text, "rig.toml").value();
  (void)read_lines_settings(table);
  const auto fine = table.finish();
  return fine ? "" : fine.error().text();
}

TEST(LinesSettings, AnInputIsWiredSoThatABrokenWireReadsActive) {
  const auto settings = read("chip = 'cp2112_gpio'\n[input.emergency_stop]\noffset = 3\n");
  EXPECT_EQ(settings.chip, "cp2112_gpio");
  ASSERT_EQ(settings.lines.size(), 1U);
  const LineSettings& line = settings.lines[0];
  EXPECT_EQ(line.request.name, "emergency_stop");
  EXPECT_EQ(line.request.offset, 3U);
  EXPECT_FALSE(line.request.output);
  EXPECT_FALSE(line.request.active_low);
  EXPECT_EQ(line.request.bias, Bias::pull_up);
  EXPECT_TRUE(line.request.edges);
  EXPECT_EQ(line.debounce_ns, 0);
  EXPECT_FALSE(settings.light);
}

TEST(LinesSettings, EveryKeyIsRead) {
  const auto settings = read(R"(
chip = "/dev/gpiochip1"
poll_ms = 25
[input.limit]
line = "GPIO4"
active = "low"
bias = "pull-down"
edges = "polled"
debounce_ms = 2.5
[output.lamp]
offset = 5
active = "low"
drive = "open-drain"
at_start = "keep"
at_exit = "active"
[output.shutter]
offset = 6
verify = false
[output.trigger]
offset = 7
pulse_us = 250
[light]
relay = "lamp"
shutter = "shutter"
warm_up_s = 300
)");
  EXPECT_EQ(settings.poll, std::chrono::milliseconds(25));
  ASSERT_EQ(settings.lines.size(), 4U);
  const LineSettings& limit = settings.lines[0];
  EXPECT_FALSE(limit.request.offset);
  EXPECT_EQ(limit.request.label, "GPIO4");
  EXPECT_TRUE(limit.request.active_low);
  EXPECT_EQ(limit.request.bias, Bias::pull_down);
  EXPECT_FALSE(limit.request.edges);
  EXPECT_EQ(limit.debounce_ns, 2'500'000);
  const LineSettings& lamp = settings.lines[1];
  EXPECT_TRUE(lamp.request.output);
  EXPECT_EQ(lamp.request.drive, Drive::open_drain);
  EXPECT_FALSE(lamp.verify);
  EXPECT_EQ(lamp.request.at_start, Rest::keep);
  EXPECT_EQ(lamp.at_exit, Rest::active);
  EXPECT_FALSE(settings.lines[2].verify);
  EXPECT_EQ(settings.lines[3].pulse_ns, 250'000);
  EXPECT_TRUE(settings.lines[3].verify);
  ASSERT_TRUE(settings.light);
  EXPECT_EQ(settings.light->relay, "lamp");
  EXPECT_EQ(settings.light->shutter, "shutter");
  EXPECT_EQ(settings.light->warm_up_s, 300);
  const auto lines = lines_of(settings);
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[1].name, "lamp");
  EXPECT_TRUE(lines[1].output);
  EXPECT_EQ(lines[1].at_rest, true) << "its at_exit";
  EXPECT_FALSE(lines[0].at_rest.has_value()) << "an input rests nowhere";
}

TEST(LinesSettings, MistakesNameTheirKey) {
  const std::string chip = "chip = 'x'\n";
  EXPECT_THAT(mistakes("[input.a]\noffset = 1\n"), HasSubstr("chip: is missing"));
  EXPECT_THAT(mistakes("chip = ''\n[input.a]\noffset = 1\n"), HasSubstr("names no chip"));
  EXPECT_THAT(mistakes(chip), HasSubstr("given no line"));
  EXPECT_THAT(mistakes(chip + "[input.a]\n"), HasSubstr("input.a: nothing says which line"));
  EXPECT_THAT(mistakes(chip + "[input.a]\noffset = 1\nline = 'x'\n"), HasSubstr("both offset and line"));
  EXPECT_THAT(mistakes(chip + "[input.a]\noffset = -1\n"), HasSubstr("input.a.offset"));
  EXPECT_THAT(mistakes(chip + "[input.a]\nline = 'a b'\n"), HasSubstr("has no spaces"));
  EXPECT_THAT(mistakes(chip + "[input.a]\noffset = 1\nactive = 'yes'\n"), HasSubstr("input.a.active"));
  EXPECT_THAT(mistakes(chip + "[input.a]\noffset = 1\nat_start = 'active'\n"), HasSubstr("unknown key"));
  EXPECT_THAT(mistakes(chip + "[input.a]\noffset = 1\ndebounce_ms = 5000\n"),
              HasSubstr("input.a.debounce_ms"));
  EXPECT_THAT(mistakes(chip + "[input.a]\noffset = 1\n[input.b]\noffset = 1\n"),
              HasSubstr("'a' and 'b' are the same line"));
  EXPECT_THAT(mistakes(chip + "[input.a]\nline = 'X'\n[output.b]\nline = 'X'\n"), HasSubstr("the same line"));
  EXPECT_THAT(mistakes(chip + "[input.a]\noffset = 1\n[output.a]\noffset = 2\n"),
              HasSubstr("'a' is an input and an output"));
  EXPECT_THAT(mistakes(chip + "[output.a]\noffset = 1\npulse_us = 50000\n"), HasSubstr("output.a.pulse_us"));
  EXPECT_THAT(mistakes(chip + "[output.a]\noffset = 1\npulse_us = 5\nat_start = 'active'\n"),
              HasSubstr("rests inactive"));
}

TEST(LinesSettings, ALightIsMadeOfOutputs) {
  const std::string lines =
      "chip = 'x'\n[input.in]\noffset = 0\n[output.lamp]\noffset = 1\n"
      "[output.trigger]\noffset = 2\npulse_us = 100\n";
  EXPECT_THAT(mistakes(lines + "[light]\n"), HasSubstr("light.relay: is missing"));
  EXPECT_THAT(mistakes(lines + "[light]\nrelay = 'in'\n"), HasSubstr("there is no output 'in'"));
  EXPECT_THAT(mistakes(lines + "[light]\nrelay = 'lamp'\nshutter = 'x'\n"),
              HasSubstr("there is no output 'x'"));
  EXPECT_THAT(mistakes(lines + "[light]\nrelay = 'lamp'\nshutter = 'lamp'\n"), HasSubstr("the same line"));
  EXPECT_THAT(mistakes(lines + "[light]\nrelay = 'trigger'\n"), HasSubstr("falls back by itself"));
  EXPECT_EQ(mistakes(lines + "[light]\nrelay = 'lamp'\n"), "");
}

}  // namespace
}  // namespace rig::drivers::gpiod_lines
