// Pixel formats by their codes, as a camera packs them (EMVA, pixel format naming convention; GigE Vision for
// the "Packed" ones).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace rig::sim::wire {

struct PfncFormat {
  std::string name;
  std::uint32_t code = 0;
  int bits = 16;
};

/// Those that pack_samples() knows: Mono and Bayer in 8 to 16 bits.
[[nodiscard]] const std::vector<PfncFormat>& pfnc_formats();
/// Significant bits of a format; 0: not known.
[[nodiscard]] int pfnc_bits(std::uint32_t code);

/// Packs samples into `bytes`, which has the room that the code says. The number of samples must be a
/// multiple of 4. False: a format that is not known.
bool pack_samples(std::uint32_t code, std::span<const std::uint16_t> samples, std::uint8_t* bytes);

}  // namespace rig::sim::wire
