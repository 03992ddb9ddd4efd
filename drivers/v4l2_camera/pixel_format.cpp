#include "drivers/v4l2_camera/pixel_format.h"

#include <algorithm>
#include <array>
#include <linux/videodev2.h>

#include "drivers/common/by_name.h"
#include "drivers/common/samples.h"

namespace rig::drivers::v4l2 {

namespace {

using Byte = std::uint8_t;
using Sample = std::uint16_t;

struct Grey {
  const char* name;
  std::uint32_t fourcc;
  int bits;
  Packing packing;
};
constexpr std::array<Grey, 7> kGrey{{{"GREY", V4L2_PIX_FMT_GREY, 8, Packing::bytes},
                                     {"Y10", V4L2_PIX_FMT_Y10, 10, Packing::words},
                                     {"Y10P", V4L2_PIX_FMT_Y10P, 10, Packing::mipi10},
                                     {"Y12", V4L2_PIX_FMT_Y12, 12, Packing::words},
                                     {"Y12P", v4l2_fourcc('Y', '1', '2', 'P'), 12, Packing::mipi12},
                                     {"Y14", V4L2_PIX_FMT_Y14, 14, Packing::words},
                                     {"Y16", V4L2_PIX_FMT_Y16, 16, Packing::words}}};

constexpr std::array<const char*, 4> kPatterns{"RGGB", "GRBG", "GBRG", "BGGR"};
struct Mosaic {
  const char* suffix;
  std::array<std::uint32_t, 4> fourccs;  // in the order of kPatterns
  int bits;
  Packing packing;
};
constexpr std::array<Mosaic, 7> kMosaics{
    {{"8",
      {V4L2_PIX_FMT_SRGGB8, V4L2_PIX_FMT_SGRBG8, V4L2_PIX_FMT_SGBRG8, V4L2_PIX_FMT_SBGGR8},
      8,
      Packing::bytes},
     {"10",
      {V4L2_PIX_FMT_SRGGB10, V4L2_PIX_FMT_SGRBG10, V4L2_PIX_FMT_SGBRG10, V4L2_PIX_FMT_SBGGR10},
      10,
      Packing::words},
     {"10P",
      {V4L2_PIX_FMT_SRGGB10P, V4L2_PIX_FMT_SGRBG10P, V4L2_PIX_FMT_SGBRG10P, V4L2_PIX_FMT_SBGGR10P},
      10,
      Packing::mipi10},
     {"12",
      {V4L2_PIX_FMT_SRGGB12, V4L2_PIX_FMT_SGRBG12, V4L2_PIX_FMT_SGBRG12, V4L2_PIX_FMT_SBGGR12},
      12,
      Packing::words},
     {"12P",
      {V4L2_PIX_FMT_SRGGB12P, V4L2_PIX_FMT_SGRBG12P, V4L2_PIX_FMT_SGBRG12P, V4L2_PIX_FMT_SBGGR12P},
      12,
      Packing::mipi12},
     {"14",
      {V4L2_PIX_FMT_SRGGB14, V4L2_PIX_FMT_SGRBG14, V4L2_PIX_FMT_SGBRG14, V4L2_PIX_FMT_SBGGR14},
      14,
      Packing::words},
     {"16",
      {V4L2_PIX_FMT_SRGGB16, V4L2_PIX_FMT_SGRBG16, V4L2_PIX_FMT_SGBRG16, V4L2_PIX_FMT_SBGGR16},
      16,
      Packing::words}}};

std::vector<PixelFormat> all_formats() {
  std::vector<PixelFormat> formats;
  formats.reserve(kGrey.size() + kMosaics.size() * kPatterns.size());
  for (const Grey& g : kGrey) formats.push_back({g.name, g.fourcc, g.bits, g.packing, "none"});
  for (const Mosaic& m : kMosaics) {
    for (std::size_t i = 0; i < kPatterns.size(); ++i) {
      formats.push_back(
          {std::string("S") + kPatterns[i] + m.suffix, m.fourccs[i], m.bits, m.packing, kPatterns[i]});
    }
  }
  return formats;
}

// kGroup samples' high bytes, then one byte with kLow low bits of each, the first sample's lowest.
template <std::size_t kGroup, unsigned kLow>
Sample mipi_sample(const Byte* line, std::size_t at) {
  constexpr unsigned kMask = (1U << kLow) - 1;
  const Byte* group = line + at / kGroup * (kGroup + 1);
  const std::size_t i = at % kGroup;
  const unsigned low = (static_cast<unsigned>(group[kGroup]) >> (kLow * i)) & kMask;
  return static_cast<Sample>((static_cast<unsigned>(group[i]) << kLow) | low);
}

template <std::size_t kGroup, unsigned kLow>
void unpack_mipi(const Byte* __restrict from, Sample* __restrict to, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to[i] = mipi_sample<kGroup, kLow>(from, i);
}

}  // namespace

const std::vector<PixelFormat>& pixel_formats() {
  static const std::vector<PixelFormat> formats = all_formats();
  return formats;
}

std::vector<std::string> pixel_format_names() {
  return names_of(pixel_formats());
}

const PixelFormat* find_pixel_format(const std::string& name) {
  return find_by_name(pixel_formats(), name);
}

const PixelFormat* find_pixel_format(std::uint32_t fourcc) {
  const auto& all = pixel_formats();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const PixelFormat& f) { return f.fourcc == fourcc; });
  return found == all.end() ? nullptr : &*found;
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (unsigned i = 0; i < 4; ++i) {
    const auto c = static_cast<char>((fourcc >> (8 * i)) & 0x7f);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

std::size_t line_bytes(Packing packing, std::size_t width) {
  switch (packing) {
    case Packing::bytes:
      return width;
    case Packing::words:
      break;
    case Packing::mipi10:
      return (width + 3) / 4 * 5;
    case Packing::mipi12:
      return (width + 1) / 2 * 3;
  }
  return width * 2;
}

std::size_t image_bytes(Packing packing, const Layout& layout) {
  const std::size_t line = line_bytes(packing, layout.width);
  if (line == 0 || layout.height == 0 || line > layout.stride) return 0;
  return (layout.height - 1) * layout.stride + line;
}

base::Result<void> unpack(Packing packing, int shift, const Layout& layout,
                          std::span<const std::uint8_t> bytes, std::span<std::uint16_t> samples) {
  const std::size_t needed = image_bytes(packing, layout);
  if (needed == 0 || samples.size() != layout.width * layout.height) {
    return base::fail(base::ErrorCode::damaged,
                      fmt::format("{} x {} samples in lines of {} bytes are no image of {}", layout.width,
                                  layout.height, layout.stride, samples.size()));
  }
  if (bytes.size() < needed) {
    return base::fail(base::ErrorCode::damaged,
                      fmt::format("{} bytes of an image that has {}", bytes.size(), needed));
  }
  for (std::size_t y = 0; y < layout.height; ++y) {
    const Byte* from = bytes.data() + y * layout.stride;
    Sample* to = samples.data() + y * layout.width;
    switch (packing) {
      case Packing::bytes:
        unpack_bytes(from, to, layout.width);
        break;
      case Packing::words:
        unpack_words(from, to, layout.width, shift);
        break;
      case Packing::mipi10:
        unpack_mipi<4, 2>(from, to, layout.width);
        break;
      case Packing::mipi12:
        unpack_mipi<2, 4>(from, to, layout.width);
        break;
    }
  }
  return {};
}

double mean_level(Packing packing, const Layout& layout, std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kAcross = 32;
  const std::size_t columns = std::max<std::size_t>(1, layout.width / kAcross);
  const std::size_t rows = std::max<std::size_t>(1, layout.height / kAcross);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t y = rows / 2; y < layout.height; y += rows) {
    const Byte* line = bytes.data() + y * layout.stride;
    for (std::size_t x = columns / 2; x < layout.width; x += columns, ++count) {
      switch (packing) {
        case Packing::bytes:
          sum += line[x];
          break;
        case Packing::words:
          sum += line[2 * x] | (line[2 * x + 1] << 8);
          break;
        case Packing::mipi10:
          sum += mipi_sample<4, 2>(line, x);
          break;
        case Packing::mipi12:
          sum += mipi_sample<2, 4>(line, x);
          break;
      }
    }
  }
  return count == 0 ? 0 : sum / static_cast<double>(count);
}

}  // namespace rig::drivers::v4l2
