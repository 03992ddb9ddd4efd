// Numbers in Modbus registers: 16-bit words, and pairs of them in either order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace rig::drivers::modbus {

/// Within a word the high byte always comes first on the wire; that is the protocol's and libmodbus does it.
enum class WordOrder { high_first, low_first };

enum class WordType { u16, i16, u32, i32 };

struct Format {
  WordType type = WordType::u16;
  WordOrder order = WordOrder::high_first;
};

/// 1 or 2.
[[nodiscard]] std::size_t words_of(WordType type);
/// What the type can hold.
[[nodiscard]] std::int64_t least(WordType type);
[[nodiscard]] std::int64_t most(WordType type);

/// The number in the first words of `words`, of which there must be words_of(format.type).
[[nodiscard]] std::int64_t decode(std::span<const std::uint16_t> words, Format format);
/// Appends the words of a number, which must lie within least and most of its type.
void encode(std::int64_t number, Format format, std::vector<std::uint16_t>& words);

}  // namespace rig::drivers::modbus
