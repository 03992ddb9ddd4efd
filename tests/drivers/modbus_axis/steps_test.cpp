// Sequences of writes: what a profile's text becomes on the wire.
#include "drivers/modbus_axis/steps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rig::drivers::modbus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr Format kLong{WordType::i32, WordOrder::high_first};
const std::vector<Option> kOptions{{"mode", {}, 1, 0, 65535}, {"type", {WordType::u32}, 1, 0, 9}};
const std::vector<Value> kValues{
    {"position",
     Quantity::position,
     kLong,
     {},
     false,
     Rounding::nearest,
     least(WordType::i32),
     most(WordType::i32)},
    {"rpm", Quantity::velocity, {}, {60 / 10000.0}, false, Rounding::down, 1, 5000}};
const std::vector<Quantity> kAll{Quantity::position, Quantity::velocity};

Write filled(const std::string& text, const OptionValues& options = {1, 1}) {
  const auto step = parse_step(text, kOptions, kValues, kAll);
  EXPECT_TRUE(step.has_value()) << step.error().text();
  if (!step) return {};
  Quantities quantities;
  quantities[Quantity::position] = -10000;
  quantities[Quantity::velocity] = 40000;
  const auto write = fill_in(*step, kOptions, options, kValues, quantities);
  EXPECT_TRUE(write.has_value()) << write.error().text();
  return write.value_or(Write{});
}

TEST(Steps, HaveTheirNumbersInPlace) {
  const Write write = filled("0x6200 = {mode} {position} {rpm} 0 -1");
  EXPECT_EQ(write.address, 0x6200);
  EXPECT_THAT(write.words, ElementsAre(1, 0xFFFF, 0xD8F0, 240, 0, 0xFFFF));
  EXPECT_THAT(filled("88 = {type}", {0x41, 2}).words, ElementsAre(0, 2));
}

std::string mistake(const std::string& text, const std::vector<Quantity>& known = kAll) {
  const auto step = parse_step(text, kOptions, kValues, known);
  EXPECT_FALSE(step.has_value()) << text;
  return step ? std::string() : step.error().text();
}

TEST(Steps, ThatAreNotUnderstoodAreAnError) {
  EXPECT_THAT(mistake(""), HasSubstr("ADDRESS = WORD"));
  EXPECT_THAT(mistake("0x6002 0x0010"), HasSubstr("ADDRESS = WORD"));
  EXPECT_THAT(mistake("0x10000 = 1"), HasSubstr("not understood"));
  EXPECT_THAT(mistake("-1 = 1"), HasSubstr("not understood"));
  EXPECT_THAT(mistake("0x6002 ="), HasSubstr("writes nothing"));
  EXPECT_THAT(mistake("0x6002 = 70000"), HasSubstr("no word of 16 bits"));
  EXPECT_THAT(mistake("0x6002 = {speed}"), HasSubstr("no value and no option 'speed'"));
  EXPECT_THAT(mistake("0xFFFF = {position}"), HasSubstr("beyond the last register"));
  std::string long_one = "0 =";
  for (int i = 0; i < 124; ++i) long_one += " 0";
  EXPECT_THAT(mistake(long_one), HasSubstr("124 words at once"));
}

TEST(Steps, UseOnlyWhatTheirSequenceKnows) {
  EXPECT_THAT(mistake("0x6001 = {position}", {Quantity::max_velocity}),
              HasSubstr("not known in this sequence"));
}

}  // namespace
}  // namespace rig::drivers::modbus
