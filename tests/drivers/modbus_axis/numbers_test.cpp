// Speeds, accelerations and places in the units of drives, and how they are rounded.
#include "drivers/modbus_axis/numbers.h"

#include <gtest/gtest.h>
#include <limits>

namespace rig::drivers::modbus {
namespace {

const std::vector<Option> kOptions{{"counts_per_turn", {}, 10000, 200, 51200}};
const OptionValues kTenThousand{10000};

// As Leadshine's drives take them.
Value rpm() {
  return {"rpm", Quantity::velocity, {}, {60, std::nullopt, 0}, false, Rounding::down, 1, 5000};
}
Value ms_per_1000rpm() {
  return {"ms", Quantity::acceleration, {}, {1e6 / 60, 0, std::nullopt}, true, Rounding::up, 1, 32767};
}
Value place() {
  return {"place",
          Quantity::position,
          {WordType::i32, WordOrder::high_first},
          {},
          false,
          Rounding::nearest,
          least(WordType::i32),
          most(WordType::i32)};
}

std::int64_t made(const Value& value, double quantity, const OptionValues& options = kTenThousand) {
  const auto number = to_drive(value, quantity, options);
  EXPECT_TRUE(number.has_value()) << number.error().text();
  return number.value_or(-1);
}

TEST(Numbers, ASpeedIsRoundedDownSoThatTheDriveIsNeverFaster) {
  EXPECT_EQ(made(rpm(), 120000), 720);
  EXPECT_EQ(made(rpm(), 120000 - 0.01), 719);
  EXPECT_EQ(made(rpm(), 120000, {51200}), 140);
}

TEST(Numbers, AWholeNumberSurvivesTheLastBitsOfItsConversion) {
  // 0.1 + 0.2 is a little more than 0.3, and 3 * 0.1 as well: both ways must give 3.
  EXPECT_EQ(made(rpm(), (0.1 + 0.2) / 60 * 1e5), 3);
  EXPECT_EQ(made(rpm(), 3 * (1 - 1e-13) / 60 * 1e4), 3);
}

TEST(Numbers, ASpeedIsAtLeastTheLeastThatTheDriveHas) {
  EXPECT_EQ(made(rpm(), 10), 1);
  EXPECT_EQ(made(rpm(), 1e9), 5000);
}

TEST(Numbers, ATimePerSpeedIsRoundedUpSoThatTheDriveIsNeverHarder) {
  // 1000 rpm are 166666.7 counts/s; at 1e6 counts/s^2 they take 166.67 ms.
  EXPECT_EQ(made(ms_per_1000rpm(), 1e6), 167);
  EXPECT_EQ(made(ms_per_1000rpm(), 1e6 / 6), 1000);
  EXPECT_EQ(made(ms_per_1000rpm(), 1e-3), 32767);
  EXPECT_EQ(made(ms_per_1000rpm(), 1e12), 1);
}

TEST(Numbers, APlaceIsTheNearestAndNeverAnother) {
  EXPECT_EQ(made(place(), -12.4), -12);
  EXPECT_EQ(made(place(), 12.5), 13);
  for (const double beyond : {3e9, -3e9, std::numeric_limits<double>::quiet_NaN()}) {
    const auto number = to_drive(place(), beyond, kTenThousand);
    ASSERT_FALSE(number.has_value()) << beyond;
    EXPECT_EQ(number.error().code, base::ErrorCode::bad_input);
  }
}

TEST(Numbers, AreReadInBothWaysOfWriting) {
  EXPECT_EQ(parse_whole("17"), 17);
  EXPECT_EQ(parse_whole("0x6002"), 0x6002);
  EXPECT_EQ(parse_whole("-1"), -1);
  EXPECT_EQ(parse_whole("0xFFFFFFFF"), 4294967295);
  EXPECT_EQ(parse_whole("-0x80000000"), -2147483648LL);
  for (const char* no : {"", "-", "0x", "1.5", "0x1G", "4294967296", "-2147483649", "+1", " 1", "1 "}) {
    EXPECT_EQ(parse_whole(no), std::nullopt) << no;
  }
}

TEST(Numbers, MayBeOptions) {
  const auto option = parse_number("{counts_per_turn}", kOptions);
  ASSERT_TRUE(option.has_value());
  EXPECT_EQ(option->value({800}), 800);
  EXPECT_FALSE(parse_number("{counts_per_turns}", kOptions).has_value());
  EXPECT_FALSE(parse_number("{}", kOptions).has_value());
  EXPECT_FALSE(parse_number("counts_per_turn", kOptions).has_value());
}

}  // namespace
}  // namespace rig::drivers::modbus
