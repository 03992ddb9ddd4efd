// The pixel formats of a simulated video device, and how it lays samples into bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace rig::sim::wire {

enum class VideoPacking { bytes, words, mipi10, mipi12, none };

struct VideoFormat {
  std::uint32_t fourcc = 0;
  const char* description = "";
  int bits = 0;
  VideoPacking packing = VideoPacking::none;  ///< none: no raw samples; offered, never painted
  bool compressed = false;
};

[[nodiscard]] const std::vector<VideoFormat>& video_formats();
/// nullptr: it has no such format.
[[nodiscard]] const VideoFormat* find_video_format(std::uint32_t fourcc);

[[nodiscard]] std::uint32_t video_line_bytes(const VideoFormat& format, std::uint32_t width);
/// One line; `bytes` has at least video_line_bytes().
void pack_video_line(const VideoFormat& format, std::span<const std::uint16_t> samples,
                     std::span<std::uint8_t> bytes);

}  // namespace rig::sim::wire
