// How the kernel lays samples into bytes, and the one pass that makes 16-bit samples of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::drivers::v4l2 {

enum class Packing {
  bytes,   ///< a sample a byte
  words,   ///< a sample in two bytes, the low one first, right-aligned
  mipi10,  ///< four samples in five bytes: their high 8 bits, then the low 2 of all four, the first lowest
  mipi12,  ///< two samples in three bytes: their high 8 bits, then the low 4 of both, the first lowest
};

/// A format by the name of its constant V4L2_PIX_FMT_... and its four characters.
struct PixelFormat {
  std::string name;          ///< "SRGGB12"
  std::uint32_t fourcc = 0;  ///< as VIDIOC_S_FMT takes it
  int bits = 16;             ///< significant bits of a sample
  Packing packing = Packing::words;
  std::string bayer;  ///< "RGGB" ..., or "none"
};

/// All that the driver knows: grey and the four Bayer patterns in 8 to 16 bits.
[[nodiscard]] const std::vector<PixelFormat>& pixel_formats();
[[nodiscard]] std::vector<std::string> pixel_format_names();
/// Nothing the driver knows: nullptr.
[[nodiscard]] const PixelFormat* find_pixel_format(const std::string& name);
[[nodiscard]] const PixelFormat* find_pixel_format(std::uint32_t fourcc);

/// "RG12" of the four characters; what cannot be printed is a question mark.
[[nodiscard]] std::string fourcc_text(std::uint32_t fourcc);

/// How an image lies in a buffer.
struct Layout {
  std::size_t width = 0, height = 0;  ///< samples
  std::size_t stride = 0;             ///< bytes from one line to the next
};

/// Bytes of the samples of one line, without what fills it up.
[[nodiscard]] std::size_t line_bytes(Packing packing, std::size_t width);
/// Bytes from the first sample of an image to its last; 0 where lines are longer than the stride.
[[nodiscard]] std::size_t image_bytes(Packing packing, const Layout& layout);

/// Unpacks an image, right-aligned, each sample shifted right by `shift` bits (of cameras that put fewer bits
/// than 16 at the top). Too few bytes, or a layout that is none: an error (damaged), and nothing is written.
[[nodiscard]] base::Result<void> unpack(Packing packing, int shift, const Layout& layout,
                                        std::span<const std::uint8_t> bytes,
                                        std::span<std::uint16_t> samples);

/// The mean of about a thousand samples spread over the image; the layout has been checked by image_bytes().
[[nodiscard]] double mean_level(Packing packing, const Layout& layout, std::span<const std::uint8_t> bytes);

}  // namespace rig::drivers::v4l2
