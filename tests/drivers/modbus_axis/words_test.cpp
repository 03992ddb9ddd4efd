// Numbers of one and two words, in both orders, to and from registers.
#include "drivers/modbus_axis/words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rig::drivers::modbus {
namespace {

using testing::ElementsAre;

std::vector<std::uint16_t> words(std::int64_t number, Format format) {
  std::vector<std::uint16_t> out;
  encode(number, format, out);
  return out;
}

TEST(Words, AreInTheOrderOfTheDrive) {
  EXPECT_THAT(words(10000, {WordType::i32, WordOrder::high_first}), ElementsAre(0x0000, 0x2710));
  EXPECT_THAT(words(10000, {WordType::i32, WordOrder::low_first}), ElementsAre(0x2710, 0x0000));
  EXPECT_THAT(words(-2, {WordType::i32, WordOrder::high_first}), ElementsAre(0xFFFF, 0xFFFE));
  EXPECT_THAT(words(-2, {WordType::i16, WordOrder::high_first}), ElementsAre(0xFFFE));
}

TEST(Words, OfOneNumberReadInTheOtherOrderAreAnotherNumber) {
  const std::vector<std::uint16_t> both{0x0001, 0x86A0};
  EXPECT_EQ(decode(both, {WordType::i32, WordOrder::high_first}), 100000);
  EXPECT_EQ(decode(both, {WordType::u32, WordOrder::low_first}), 0x86A00001);
}

TEST(Words, HaveASignWhereTheirTypeHasOne) {
  const std::vector<std::uint16_t> all_ones{0xFFFF, 0xFFFF};
  EXPECT_EQ(decode(all_ones, {WordType::u16}), 65535);
  EXPECT_EQ(decode(all_ones, {WordType::i16}), -1);
  EXPECT_EQ(decode(all_ones, {WordType::u32}), 4294967295);
  EXPECT_EQ(decode(all_ones, {WordType::i32}), -1);
}

TEST(Words, ComeBackAsTheNumberThatTheyWere) {
  for (const WordType type : {WordType::u16, WordType::i16, WordType::u32, WordType::i32}) {
    for (const WordOrder order : {WordOrder::high_first, WordOrder::low_first}) {
      for (const std::int64_t number : {least(type), std::int64_t{0}, std::int64_t{1}, most(type)}) {
        const auto made = words(number, {type, order});
        ASSERT_EQ(made.size(), words_of(type));
        EXPECT_EQ(decode(made, {type, order}), number);
      }
    }
  }
}

}  // namespace
}  // namespace rig::drivers::modbus
