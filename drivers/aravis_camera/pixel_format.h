// How a GenICam camera lays samples into bytes, and the one pass that makes 16-bit samples of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::drivers::aravis {

enum class Packing {
  bytes,          ///< a sample a byte
  words,          ///< a sample in two bytes, the low one first, right-aligned
  gige_packed10,  ///< "Packed" of GigE Vision: two samples in three bytes, their high 8 bits in the outer two
  gige_packed12,
  pfnc_packed10,  ///< "p" of the naming convention: a stream of bits, each sample's lowest first
  pfnc_packed12,
};

/// A format by its name and code in the pixel format naming convention (EMVA, PFNC).
struct PixelFormat {
  std::string name;        ///< "BayerRG12p"
  std::uint32_t code = 0;  ///< as the camera states it in each frame
  int bits = 16;           ///< significant bits of a sample
  Packing packing = Packing::words;
  std::string bayer;  ///< "RGGB" ..., or "none"
};

/// All that the driver knows: Mono and the four Bayer patterns in 8, 10, 12 and 16 bits and the packed ones.
[[nodiscard]] const std::vector<PixelFormat>& pixel_formats();
[[nodiscard]] std::vector<std::string> pixel_format_names();
/// Nothing the driver knows: nullptr.
[[nodiscard]] const PixelFormat* find_pixel_format(const std::string& name);

/// Bytes of an image of so many samples; packed formats have no gaps between lines, and the last byte may
/// hold bits of no sample.
[[nodiscard]] std::size_t bytes_of(Packing packing, std::size_t samples);

/// Unpacks `samples.size()` samples, right-aligned, each shifted right by `shift` bits (of cameras that put
/// fewer bits than 16 at the top). Fewer bytes than bytes_of(): an error (damaged), and nothing is written.
[[nodiscard]] base::Result<void> unpack(Packing packing, int shift, std::span<const std::uint8_t> bytes,
                                        std::span<std::uint16_t> samples);

}  // namespace rig::drivers::aravis
