#include "sim/wire/pfnc.h"

#include <algorithm>

namespace rig::sim::wire {

namespace {

// A bit stream, lowest bits first.
void pack_stream(std::span<const std::uint16_t> samples, unsigned bits, std::uint8_t* bytes) {
  std::uint32_t held = 0;
  unsigned count = 0;
  for (const std::uint16_t sample : samples) {
    held |= static_cast<std::uint32_t>(sample) << count;
    for (count += bits; count >= 8; count -= 8, held >>= 8) *bytes++ = static_cast<std::uint8_t>(held);
  }
}

// Pairs: the high eight bits of the first, the low bits of both, the high eight bits of the second.
void pack_pairs(std::span<const std::uint16_t> samples, unsigned bits, std::uint8_t* bytes) {
  const unsigned low = bits - 8, mask = (1U << low) - 1;
  for (std::size_t i = 0; i + 1 < samples.size(); i += 2) {
    const unsigned a = samples[i], b = samples[i + 1];
    *bytes++ = static_cast<std::uint8_t>(a >> low);
    *bytes++ = static_cast<std::uint8_t>((a & mask) | ((b & mask) << 4));
    *bytes++ = static_cast<std::uint8_t>(b >> low);
  }
}

bool is_packed_pair(const std::string& name) {
  return name.ends_with("Packed");
}

}  // namespace

const std::vector<PfncFormat>& pfnc_formats() {
  static const std::vector<PfncFormat> formats{
      {"Mono8", 0x01080001, 8},           {"Mono10", 0x01100003, 10},     {"Mono10Packed", 0x010c0004, 10},
      {"Mono10p", 0x010a0046, 10},        {"Mono12", 0x01100005, 12},     {"Mono12Packed", 0x010c0006, 12},
      {"Mono12p", 0x010c0047, 12},        {"Mono16", 0x01100007, 16},     {"BayerGR8", 0x01080008, 8},
      {"BayerRG8", 0x01080009, 8},        {"BayerGB8", 0x0108000a, 8},    {"BayerBG8", 0x0108000b, 8},
      {"BayerGR10", 0x0110000c, 10},      {"BayerRG10", 0x0110000d, 10},  {"BayerGB10", 0x0110000e, 10},
      {"BayerBG10", 0x0110000f, 10},      {"BayerGR12", 0x01100010, 12},  {"BayerRG12", 0x01100011, 12},
      {"BayerGB12", 0x01100012, 12},      {"BayerBG12", 0x01100013, 12},  {"BayerGR16", 0x0110002e, 16},
      {"BayerRG16", 0x0110002f, 16},      {"BayerGB16", 0x01100030, 16},  {"BayerBG16", 0x01100031, 16},
      {"BayerRG10p", 0x010a0058, 10},     {"BayerGR12p", 0x010c0057, 12}, {"BayerRG12p", 0x010c0059, 12},
      {"BayerGB12p", 0x010c0055, 12},     {"BayerBG12p", 0x010c0053, 12}, {"BayerRG10Packed", 0x010c0027, 10},
      {"BayerRG12Packed", 0x010c002b, 12}};
  return formats;
}

int pfnc_bits(std::uint32_t code) {
  const auto& all = pfnc_formats();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const PfncFormat& f) { return f.code == code; });
  return found == all.end() ? 0 : found->bits;
}

bool pack_samples(std::uint32_t code, std::span<const std::uint16_t> samples, std::uint8_t* bytes) {
  const auto& all = pfnc_formats();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const PfncFormat& f) { return f.code == code; });
  if (found == all.end()) return false;
  const unsigned per_pixel = (code >> 16) & 0xff;
  const auto bits = static_cast<unsigned>(found->bits);
  if (is_packed_pair(found->name)) {
    pack_pairs(samples, bits, bytes);
  } else if (per_pixel == 8) {
    std::transform(samples.begin(), samples.end(), bytes,
                   [](std::uint16_t v) { return static_cast<std::uint8_t>(v); });
  } else {
    pack_stream(samples, per_pixel, bytes);  // 16 bits too: whole bytes, the low one first
  }
  return true;
}

}  // namespace rig::sim::wire
