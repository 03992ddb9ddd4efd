// Flags: what bits and numbers in a register mean.
#include "drivers/modbus_axis/flags.h"

#include <gtest/gtest.h>

namespace rig::drivers::modbus {
namespace {

const std::vector<std::string> kRegisters{"status", "inputs"};
const std::vector<Option> kOptions{{"mask", {}, 0, 0, 65535}};

bool holds(const std::string& text, std::int64_t raw, std::int64_t option = 0) {
  const auto flag = parse_flag(text, kRegisters, kOptions);
  EXPECT_TRUE(flag.has_value()) << flag.error().text();
  return flag && modbus::holds(*flag, raw, {option});
}

TEST(Flags, AreBitsOfAStatus) {
  // Leadshine: 0x0006 is moving, 0x0032 stopped with both "complete".
  EXPECT_TRUE(holds("status & 0x0004", 0x0006));
  EXPECT_FALSE(holds("status & 0x0004", 0x0032));
  EXPECT_FALSE(holds("status & 0x0010", 0x0006));
  EXPECT_TRUE(holds("status & 0x0010", 0x0032));
}

TEST(Flags, AreSeveralBitsAtOnce) {
  EXPECT_TRUE(holds("status & 0x4020", 0x4000));
  EXPECT_FALSE(holds("status & 0x4020 == 0x4020", 0x4000));
  EXPECT_TRUE(holds("status & 0x4020 == 0x4020", 0x4120));
  EXPECT_TRUE(holds("status & 0x4020 != 0x4020", 0x4000));
}

TEST(Flags, AreWholeNumbers) {
  EXPECT_TRUE(holds("status == 3", 3));
  EXPECT_FALSE(holds("status != 3", 3));
  EXPECT_TRUE(holds("status == -1", 0xFFFFFFFF));
}

TEST(Flags, HaveAnOpposite) {
  EXPECT_FALSE(holds("not status & 0x0040", 0x0040));
  EXPECT_TRUE(holds("not status & 0x0040", 0));
  EXPECT_FALSE(holds("never", 0xFFFF));
  EXPECT_TRUE(holds("always", 0));
}

TEST(Flags, AMaskThatIsNothingTellsNothing) {
  EXPECT_FALSE(holds("inputs & {mask}", 0xFFFF, 0));
  EXPECT_FALSE(holds("not inputs & {mask}", 0, 0));
  EXPECT_TRUE(holds("inputs & {mask}", 0x0008, 0x0008));
  EXPECT_TRUE(holds("not inputs & {mask}", 0, 0x0008));
  const auto flag = parse_flag("inputs & {mask}", kRegisters, kOptions);
  EXPECT_FALSE(is_told(*flag, {0}));
  EXPECT_TRUE(is_told(*flag, {1}));
}

TEST(Flags, ThatAreNotUnderstoodAreAnError) {
  for (const char* text : {"", "status", "not", "not status", "nowhere & 1", "status & ", "status & one",
                           "status & 1 == ", "status & 1 & 2", "status == 1 2", "status & {nothing}",
                           "status = 1", "not not status & 1", "status & 1 more"}) {
    EXPECT_FALSE(parse_flag(text, kRegisters, kOptions).has_value()) << text;
  }
}

}  // namespace
}  // namespace rig::drivers::modbus
