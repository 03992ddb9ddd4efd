#include "sim/wire/v4l2_formats.h"

#include <algorithm>
#include <linux/videodev2.h>

namespace rig::sim::wire {

namespace {

constexpr std::uint32_t kY12P = v4l2_fourcc('Y', '1', '2', 'P');

// Groups of kGroup samples: the high 8 bits of each, then one byte of their low bits, the first sample's
// lowest.
template <std::size_t kGroup>
void pack_mipi(int low_bits, std::span<const std::uint16_t> samples, std::span<std::uint8_t> bytes) {
  std::size_t to = 0;
  for (std::size_t at = 0; at < samples.size(); at += kGroup) {
    unsigned low = 0;
    for (std::size_t i = 0; i < kGroup; ++i) {
      const unsigned sample = at + i < samples.size() ? samples[at + i] : 0U;
      bytes[to++] = static_cast<std::uint8_t>(sample >> low_bits);
      low |= (sample & ((1U << low_bits) - 1)) << (static_cast<unsigned>(low_bits) * i);
    }
    bytes[to++] = static_cast<std::uint8_t>(low);
  }
}

}  // namespace

const std::vector<VideoFormat>& video_formats() {
  using enum VideoPacking;
  static const std::vector<VideoFormat> formats{
      {V4L2_PIX_FMT_YUYV, "YUYV 4:2:2", 8, none, false},
      {V4L2_PIX_FMT_MJPEG, "Motion-JPEG", 8, none, true},
      {V4L2_PIX_FMT_GREY, "8-bit Greyscale", 8, bytes, false},
      {V4L2_PIX_FMT_Y10, "10-bit Greyscale", 10, words, false},
      {V4L2_PIX_FMT_Y10P, "10-bit Greyscale (MIPI Packed)", 10, mipi10, false},
      {V4L2_PIX_FMT_Y12, "12-bit Greyscale", 12, words, false},
      {kY12P, "12-bit Greyscale (MIPI Packed)", 12, mipi12, false},
      {V4L2_PIX_FMT_Y14, "14-bit Greyscale", 14, words, false},
      {V4L2_PIX_FMT_Y16, "16-bit Greyscale", 16, words, false},
      {V4L2_PIX_FMT_SRGGB8, "8-bit Bayer RGRG/GBGB", 8, bytes, false},
      {V4L2_PIX_FMT_SGRBG10, "10-bit Bayer GRGR/BGBG", 10, words, false},
      {V4L2_PIX_FMT_SGBRG10P, "10-bit Bayer GBGB/RGRG Packed", 10, mipi10, false},
      {V4L2_PIX_FMT_SBGGR12, "12-bit Bayer BGBG/GRGR", 12, words, false},
      {V4L2_PIX_FMT_SRGGB12P, "12-bit Bayer RGRG/GBGB Packed", 12, mipi12, false},
      {V4L2_PIX_FMT_SRGGB16, "16-bit Bayer RGRG/GBGB", 16, words, false}};
  return formats;
}

const VideoFormat* find_video_format(std::uint32_t fourcc) {
  const auto& all = video_formats();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const VideoFormat& f) { return f.fourcc == fourcc; });
  return found == all.end() ? nullptr : &*found;
}

std::uint32_t video_line_bytes(const VideoFormat& format, std::uint32_t width) {
  switch (format.packing) {
    case VideoPacking::bytes:
      return width;
    case VideoPacking::mipi10:
      return (width + 3) / 4 * 5;
    case VideoPacking::mipi12:
      return (width + 1) / 2 * 3;
    case VideoPacking::words:
    case VideoPacking::none:
      break;
  }
  return 2 * width;
}

void pack_video_line(const VideoFormat& format, std::span<const std::uint16_t> samples,
                     std::span<std::uint8_t> bytes) {
  switch (format.packing) {
    case VideoPacking::bytes:
      std::transform(samples.begin(), samples.end(), bytes.begin(),
                     [](std::uint16_t s) { return static_cast<std::uint8_t>(s); });
      break;
    case VideoPacking::words:
      for (std::size_t x = 0; x < samples.size(); ++x) {
        bytes[2 * x] = static_cast<std::uint8_t>(samples[x]);
        bytes[2 * x + 1] = static_cast<std::uint8_t>(samples[x] >> 8);
      }
      break;
    case VideoPacking::mipi10:
      pack_mipi<4>(2, samples, bytes);
      break;
    case VideoPacking::mipi12:
      pack_mipi<2>(4, samples, bytes);
      break;
    case VideoPacking::none:
      break;
  }
}

}  // namespace rig::sim::wire
