#include "sim/wire/uvc_picture.h"

#include <algorithm>
#include <array>

namespace rig::sim::wire {

namespace {

constexpr std::uint32_t kFullScale = 65535;
constexpr std::uint32_t kOne = 0xC000, kHalf = 0x8000, kZero = 0x4000;  // of a bit in row 0
constexpr std::size_t kBands = 8;

struct Field {
  std::uint32_t value;
  int bits;
};

std::array<Field, 5> stamp(const UvcPictureFacts& f) {
  return {{{f.frame, 32},
           {f.settings.exposure_100us, 32},
           {f.settings.gain, 16},
           {f.settings.brightness, 16},
           {f.light, 16}}};
}

void put_sample(std::vector<std::uint8_t>& to, std::uint32_t level, const UvcFormat& format) {
  uvc_append(to, level >> (16 - format.bits), static_cast<std::size_t>(format.bytes));
}

std::vector<std::uint8_t> row_of(const UvcPictureFacts& f, const UvcFormat& format, std::size_t width,
                                 bool odd) {
  std::vector<std::uint8_t> row;
  row.reserve(width * static_cast<std::size_t>(format.bytes));
  const std::uint64_t black = std::uint64_t{16} * f.settings.brightness;
  const std::uint64_t gathered = std::uint64_t{f.settings.exposure_100us} * f.settings.gain * f.light;
  for (std::size_t x = 0; x < width; ++x) {
    std::uint64_t light = gathered * (1 + kBands * x / width) / kUvcDaylight;
    const bool odd_column = x % 2 == 1;
    if (format.bayer && odd == odd_column) light /= odd ? 4 : 2;
    put_sample(row, static_cast<std::uint32_t>(std::min<std::uint64_t>(kFullScale, black + light)), format);
  }
  return row;
}

}  // namespace

std::vector<std::uint8_t> paint_uvc_picture(const UvcPictureFacts& facts, const UvcFormat& format,
                                            const UvcSize& size) {
  std::vector<std::uint8_t> frame;
  frame.reserve(uvc_frame_bytes(format, size));
  const std::array rows{row_of(facts, format, size.width, false), row_of(facts, format, size.width, true)};
  for (const Field& field : stamp(facts)) {
    for (int bit = 0; bit < field.bits; ++bit) {
      put_sample(frame, (field.value >> bit) & 1U ? kOne : kZero, format);
    }
  }
  frame.insert(frame.end(), rows[0].begin() + static_cast<std::ptrdiff_t>(frame.size()), rows[0].end());
  for (std::size_t y = 1; y < size.height; ++y) {
    frame.insert(frame.end(), rows.at(y % 2).begin(), rows.at(y % 2).end());
  }
  return frame;
}

std::optional<UvcPictureFacts> read_uvc_picture(std::span<const std::uint8_t> frame, const UvcFormat& format,
                                                const UvcSize& size) {
  if (frame.size() != uvc_frame_bytes(format, size)) return std::nullopt;
  std::size_t at = 0;
  const auto field = [&](int bits) {
    std::uint32_t value = 0;
    for (int bit = 0; bit < bits; ++bit) {
      const auto bytes = static_cast<std::size_t>(format.bytes);
      if (uvc_number(frame.subspan(at, bytes)) >= kHalf >> (16 - format.bits)) value |= 1U << bit;
      at += bytes;
    }
    return value;
  };
  UvcPictureFacts facts;
  facts.frame = field(32);
  facts.settings.exposure_100us = field(32);
  facts.settings.gain = field(16);
  facts.settings.brightness = field(16);
  facts.light = field(16);
  const std::vector<std::uint8_t> expected = paint_uvc_picture(facts, format, size);
  if (!std::equal(expected.begin(), expected.end(), frame.begin(), frame.end())) return std::nullopt;
  return facts;
}

}  // namespace rig::sim::wire
