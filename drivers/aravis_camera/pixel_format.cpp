#include "drivers/aravis_camera/pixel_format.h"

#include <array>
#include <utility>

#include "drivers/common/by_name.h"
#include "drivers/common/samples.h"

namespace rig::drivers::aravis {

namespace {

using Byte = std::uint8_t;
using Sample = std::uint16_t;

struct Mono {
  const char* suffix;
  std::uint32_t code;
  int bits;
  Packing packing;
};
constexpr std::array<Mono, 8> kMono{{{"8", 0x01080001, 8, Packing::bytes},
                                     {"10", 0x01100003, 10, Packing::words},
                                     {"10Packed", 0x010c0004, 10, Packing::gige_packed10},
                                     {"10p", 0x010a0046, 10, Packing::pfnc_packed10},
                                     {"12", 0x01100005, 12, Packing::words},
                                     {"12Packed", 0x010c0006, 12, Packing::gige_packed12},
                                     {"12p", 0x010c0047, 12, Packing::pfnc_packed12},
                                     {"16", 0x01100007, 16, Packing::words}}};

// The codes of a Bayer format in the order GR, RG, GB, BG.
struct Mosaic {
  const char* suffix;
  std::array<std::uint32_t, 4> codes;
  int bits;
  Packing packing;
};
constexpr std::array<Mosaic, 8> kMosaics{
    {{"8", {0x01080008, 0x01080009, 0x0108000a, 0x0108000b}, 8, Packing::bytes},
     {"10", {0x0110000c, 0x0110000d, 0x0110000e, 0x0110000f}, 10, Packing::words},
     {"10Packed", {0x010c0026, 0x010c0027, 0x010c0028, 0x010c0029}, 10, Packing::gige_packed10},
     {"10p", {0x010a0056, 0x010a0058, 0x010a0054, 0x010a0052}, 10, Packing::pfnc_packed10},
     {"12", {0x01100010, 0x01100011, 0x01100012, 0x01100013}, 12, Packing::words},
     {"12Packed", {0x010c002a, 0x010c002b, 0x010c002c, 0x010c002d}, 12, Packing::gige_packed12},
     {"12p", {0x010c0057, 0x010c0059, 0x010c0055, 0x010c0053}, 12, Packing::pfnc_packed12},
     {"16", {0x0110002e, 0x0110002f, 0x01100030, 0x01100031}, 16, Packing::words}}};
constexpr std::array<std::pair<const char*, const char*>, 4> kPatterns{
    {{"GR", "GRBG"}, {"RG", "RGGB"}, {"GB", "GBRG"}, {"BG", "BGGR"}}};

std::vector<PixelFormat> all_formats() {
  std::vector<PixelFormat> formats;
  formats.reserve(kMono.size() + kMosaics.size() * kPatterns.size());
  for (const Mono& m : kMono)
    formats.push_back({std::string("Mono") + m.suffix, m.code, m.bits, m.packing, "none"});
  for (const Mosaic& m : kMosaics) {
    for (std::size_t i = 0; i < kPatterns.size(); ++i) {
      formats.push_back({std::string("Bayer") + kPatterns[i].first + m.suffix, m.codes[i], m.bits, m.packing,
                         kPatterns[i].second});
    }
  }
  return formats;
}

// The middle byte has the low bits of both: of the first from bit 0, of the second from bit 4.
template <int kLowBits>
void unpack_gige(const Byte* __restrict from, Sample* __restrict to, std::size_t count) {
  constexpr int kMask = (1 << kLowBits) - 1;
  for (std::size_t i = 0; i + 1 < count; i += 2, from += 3) {
    to[i] = static_cast<Sample>((from[0] << kLowBits) | (from[1] & kMask));
    to[i + 1] = static_cast<Sample>((from[2] << kLowBits) | ((from[1] >> 4) & kMask));
  }
  if (count % 2 != 0) to[count - 1] = static_cast<Sample>((from[0] << kLowBits) | (from[1] & kMask));
}

void unpack_pfnc12(const Byte* __restrict from, Sample* __restrict to, std::size_t count) {
  for (std::size_t i = 0; i + 1 < count; i += 2, from += 3) {
    to[i] = static_cast<Sample>(from[0] | ((from[1] & 0x0f) << 8));
    to[i + 1] = static_cast<Sample>((from[1] >> 4) | (from[2] << 4));
  }
  if (count % 2 != 0) to[count - 1] = static_cast<Sample>(from[0] | ((from[1] & 0x0f) << 8));
}

void unpack_pfnc10(const Byte* __restrict from, Sample* __restrict to, std::size_t count) {
  std::size_t i = 0;
  for (; i + 3 < count; i += 4, from += 5) {
    to[i] = static_cast<Sample>(from[0] | ((from[1] & 0x03) << 8));
    to[i + 1] = static_cast<Sample>((from[1] >> 2) | ((from[2] & 0x0f) << 6));
    to[i + 2] = static_cast<Sample>((from[2] >> 4) | ((from[3] & 0x3f) << 4));
    to[i + 3] = static_cast<Sample>((from[3] >> 6) | (from[4] << 2));
  }
  for (int bit = 0; i < count; ++i, bit += 10) {
    const Byte* at = from + bit / 8;
    to[i] = static_cast<Sample>(((at[0] | (at[1] << 8)) >> (bit % 8)) & 0x3ff);
  }
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

std::size_t bytes_of(Packing packing, std::size_t samples) {
  switch (packing) {
    case Packing::bytes:
      return samples;
    case Packing::words:
      return samples * 2;
    case Packing::gige_packed10:
    case Packing::gige_packed12:
    case Packing::pfnc_packed12:
      return (samples * 12 + 7) / 8;
    case Packing::pfnc_packed10:
      return (samples * 10 + 7) / 8;
  }
  return samples * 2;
}

base::Result<void> unpack(Packing packing, int shift, std::span<const std::uint8_t> bytes,
                          std::span<std::uint16_t> samples) {
  const std::size_t needed = bytes_of(packing, samples.size());
  if (bytes.size() < needed) {
    return base::fail(base::ErrorCode::damaged,
                      fmt::format("{} bytes of an image that has {}", bytes.size(), needed));
  }
  if (samples.empty()) return {};
  switch (packing) {
    case Packing::bytes:
      unpack_bytes(bytes.data(), samples.data(), samples.size());
      break;
    case Packing::words:
      unpack_words(bytes.data(), samples.data(), samples.size(), shift);
      break;
    case Packing::gige_packed10:
      unpack_gige<2>(bytes.data(), samples.data(), samples.size());
      break;
    case Packing::gige_packed12:
      unpack_gige<4>(bytes.data(), samples.data(), samples.size());
      break;
    case Packing::pfnc_packed10:
      unpack_pfnc10(bytes.data(), samples.data(), samples.size());
      break;
    case Packing::pfnc_packed12:
      unpack_pfnc12(bytes.data(), samples.data(), samples.size());
      break;
  }
  return {};
}

}  // namespace rig::drivers::aravis
