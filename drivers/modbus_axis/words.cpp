#include "drivers/modbus_axis/words.h"

#include <limits>

namespace rig::drivers::modbus {

std::size_t words_of(WordType type) {
  return type == WordType::u32 || type == WordType::i32 ? 2 : 1;
}

std::int64_t least(WordType type) {
  if (type == WordType::i16) return std::numeric_limits<std::int16_t>::min();
  if (type == WordType::i32) return std::numeric_limits<std::int32_t>::min();
  return 0;
}

std::int64_t most(WordType type) {
  if (type == WordType::u16) return std::numeric_limits<std::uint16_t>::max();
  if (type == WordType::i16) return std::numeric_limits<std::int16_t>::max();
  if (type == WordType::u32) return std::numeric_limits<std::uint32_t>::max();
  return std::numeric_limits<std::int32_t>::max();
}

std::int64_t decode(std::span<const std::uint16_t> words, Format format) {
  if (format.type == WordType::u16) return words[0];
  if (format.type == WordType::i16) return static_cast<std::int16_t>(words[0]);
  const bool high_first = format.order == WordOrder::high_first;
  const std::uint32_t high = words[high_first ? 0 : 1];
  const std::uint32_t low = words[high_first ? 1 : 0];
  const std::uint32_t both = high << 16U | low;
  return format.type == WordType::u32 ? std::int64_t{both} : std::int64_t{static_cast<std::int32_t>(both)};
}

void encode(std::int64_t number, Format format, std::vector<std::uint16_t>& words) {
  const auto low = static_cast<std::uint16_t>(static_cast<std::uint64_t>(number));
  if (words_of(format.type) == 1) {
    words.push_back(low);
    return;
  }
  const auto high = static_cast<std::uint16_t>(static_cast<std::uint64_t>(number) >> 16U);
  words.push_back(format.order == WordOrder::high_first ? high : low);
  words.push_back(format.order == WordOrder::high_first ? low : high);
}

}  // namespace rig::drivers::modbus
