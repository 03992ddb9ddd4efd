// A picture that tells how it was taken, in every one of its pixels: what a simulated camera paints, and what
// a test reads out of the frame that arrived.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace rig::sim::wire {

struct PatternFacts {
  std::uint32_t exposure_us = 0;
  std::uint32_t frame = 0;
  std::uint32_t gain = 0;  ///< the camera's raw gain, up to 255

  [[nodiscard]] bool operator==(const PatternFacts&) const = default;
};

/// The first samples say the facts, the low 8 bits at a time; all the others follow from them and from the
/// place. At least this many samples a picture.
inline constexpr std::size_t kPatternHeader = 12;

/// One line of the picture, in samples of `bits` bits (8 to 16).
void paint_pattern_line(const PatternFacts& facts, int bits, std::size_t line,
                        std::span<std::uint16_t> samples);

/// What the picture says; nothing where a single sample contradicts it.
[[nodiscard]] std::optional<PatternFacts> read_pattern(std::span<const std::uint16_t> samples,
                                                       std::size_t width, int bits);
/// The same of a camera's 8-bit samples as they came.
[[nodiscard]] std::optional<PatternFacts> read_pattern(std::span<const std::uint8_t> samples,
                                                       std::size_t width);

}  // namespace rig::sim::wire
