// What all cameras lay alike: samples of a byte, and of two. Inline, so that each driver's passes over whole
// frames are compiled as its others are.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace rig::drivers {

inline void unpack_bytes(const std::uint8_t* __restrict from, std::uint16_t* __restrict to,
                         std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to[i] = from[i];
}

/// The low byte first; each sample is shifted right by `shift` bits.
inline void unpack_words(const std::uint8_t* __restrict from, std::uint16_t* __restrict to, std::size_t count,
                         int shift) {
  if (std::endian::native == std::endian::little && shift == 0) {
    std::memcpy(to, from, count * sizeof(std::uint16_t));
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    to[i] = static_cast<std::uint16_t>((from[2 * i] | (from[2 * i + 1] << 8)) >> shift);
  }
}

}  // namespace rig::drivers
