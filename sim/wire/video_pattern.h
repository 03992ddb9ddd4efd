// A picture that tells how it was taken: its first samples say it, and its brightness and every other sample
// follow from it. What a simulated video device paints, and what a test reads out of the frame that arrived.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace rig::sim::wire {

struct VideoFacts {
  std::uint32_t exposure_us = 0;
  std::uint32_t frame = 0;
  std::uint8_t gain = 0;     ///< the control's value
  std::uint8_t light = 100;  ///< of the scene: 0 is darkness

  [[nodiscard]] bool operator==(const VideoFacts&) const = default;
};

/// At least this many samples a line.
inline constexpr std::size_t kVideoHeader = 12;

/// One line of the picture, in samples of `bits` bits (8 to 16).
void paint_video_line(const VideoFacts& facts, int bits, std::size_t line, std::span<std::uint16_t> samples);

/// What the picture says; nothing where a single sample contradicts it.
[[nodiscard]] std::optional<VideoFacts> read_video(std::span<const std::uint16_t> samples, std::size_t width,
                                                   int bits);

}  // namespace rig::sim::wire
