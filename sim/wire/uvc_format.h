// What the simulated USB video camera can take: formats, sizes, intervals, by the indices of its descriptors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace rig::sim::wire {

struct UvcFormat {
  /// The first four bytes of guidFormat; the other twelve are the same for all.
  std::array<char, 4> four;
  int bits = 8;        ///< of a sample, in the low bits of its bytes
  int bytes = 1;       ///< of a sample, the least significant first
  bool bayer = false;  ///< red in the corner, then green, green and blue
};

/// As Linux' uvcvideo knows them: GREY, Y12, Y16, SRGGB8.
inline constexpr std::array<UvcFormat, 4> kUvcFormats{{
    {{'Y', '8', ' ', ' '}, 8, 1, false},
    {{'Y', '1', '2', ' '}, 12, 2, false},
    {{'Y', '1', '6', ' '}, 16, 2, false},
    {{'R', 'G', 'G', 'B'}, 8, 1, true},
}};

struct UvcSize {
  std::uint16_t width = 0, height = 0;
};

/// Each format has all of them.
inline constexpr std::array<UvcSize, 2> kUvcSizes{{{320, 240}, {640, 480}}};
/// From frame to frame, in 100 ns, the shortest first; each size has all of them.
inline constexpr std::array<std::uint32_t, 4> kUvcIntervals{333'333, 400'000, 1'000'000, 2'000'000};

[[nodiscard]] constexpr std::uint32_t uvc_frame_bytes(const UvcFormat& format, const UvcSize& size) {
  return std::uint32_t{size.width} * size.height * static_cast<std::uint32_t>(format.bytes);
}

/// Header and data: as much as Linux asks for in one transfer of 32 packets.
inline constexpr std::uint32_t kUvcMostPayload = 16384;
/// Ticks a second of the clock in the payload headers.
inline constexpr std::uint32_t kUvcClock_hz = 1'000'000;

/// What the host has committed to.
struct UvcStreamChoice {
  std::uint8_t format = 1, frame = 1;  ///< indices from 1, as in the descriptors
  std::uint32_t interval = kUvcIntervals[0];

  [[nodiscard]] const UvcFormat& pixels() const { return kUvcFormats.at(format - std::size_t{1}); }
  [[nodiscard]] const UvcSize& size() const { return kUvcSizes.at(frame - std::size_t{1}); }
  [[nodiscard]] bool operator==(const UvcStreamChoice&) const = default;
};

}  // namespace rig::sim::wire
