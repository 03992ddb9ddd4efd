#include "sim/wire/usb.h"

namespace rig::sim::wire {

namespace {

constexpr std::uint8_t kTypeMask = 0x60;
// Standard requests and descriptor types by their numbers in chapter 9.
enum StandardRequest : std::uint8_t {
  kGetStatus = 0,
  kClearFeature = 1,
  kSetFeature = 3,
  kSetAddress = 5,
  kGetDescriptor = 6,
  kGetConfiguration = 8,
  kSetConfiguration = 9,
  kGetInterface = 10,
  kSetInterface = 11,
};
enum DescriptorType : std::uint8_t { kDevice = 1, kConfiguration = 2, kString = 3 };

std::uint8_t low(std::uint16_t value) {
  return static_cast<std::uint8_t>(value & 0xFFU);
}
std::uint8_t high(std::uint16_t value) {
  return static_cast<std::uint8_t>(value >> 8U);
}
std::uint16_t word(std::uint8_t first, std::uint8_t second) {
  return static_cast<std::uint16_t>(first | (second << 8U));
}

}  // namespace

SetupPacket parse_setup(std::span<const std::uint8_t, 8> b) {
  return {b[0], b[1], word(b[2], b[3]), word(b[4], b[5]), word(b[6], b[7])};
}

std::array<std::uint8_t, 8> bytes_of(const SetupPacket& s) {
  return {s.request_type, s.request,     low(s.value),  high(s.value),
          low(s.index),   high(s.index), low(s.length), high(s.length)};
}

UsbDescription vendor_device(const UsbIdentity& id, const std::string& manufacturer,
                             const std::string& product, const std::string& serial,
                             const std::vector<UsbEndpoint>& endpoints) {
  constexpr std::uint8_t kVendorSpecific = 0xFF;
  UsbDescription made;
  made.device = {18,
                 kDevice,
                 0x00,
                 0x02,
                 kVendorSpecific,
                 0,
                 0,
                 64,
                 low(id.vendor),
                 high(id.vendor),
                 low(id.product),
                 high(id.product),
                 low(id.release),
                 high(id.release),
                 1,
                 2,
                 3,
                 1};
  const auto total = static_cast<std::uint16_t>(9 + 9 + 7 * endpoints.size());
  made.configuration = {9, kConfiguration, low(total), high(total), 1, 1, 0, 0x80, 50};
  constexpr std::uint8_t kInterface = 4;
  for (const int byte :
       {9, int{kInterface}, 0, 0, static_cast<int>(endpoints.size()), int{kVendorSpecific}, 0, 0, 0}) {
    made.configuration.push_back(static_cast<std::uint8_t>(byte));
  }
  constexpr std::uint8_t kEndpoint = 5;
  for (const UsbEndpoint& e : endpoints) {
    const auto kind = static_cast<std::uint8_t>(e.kind);
    for (const std::uint8_t byte :
         {std::uint8_t{7}, kEndpoint, e.address, kind, low(e.packet), high(e.packet), e.interval}) {
      made.configuration.push_back(byte);
    }
  }
  made.strings = {{1, manufacturer}, {2, product}, {3, serial}};
  return made;
}

ControlAnswer StandardRequests::descriptor(const SetupPacket& setup) const {
  const std::uint8_t index = low(setup.value);
  switch (high(setup.value)) {
    case kDevice:
      return {ControlAnswer::Kind::done, description_.device};
    case kConfiguration:
      if (index == 0) return {ControlAnswer::Kind::done, description_.configuration};
      return ControlAnswer::stalled();
    case kString: {
      constexpr std::uint16_t kEnglish = 0x0409;
      if (index == 0) return {ControlAnswer::Kind::done, {4, kString, low(kEnglish), high(kEnglish)}};
      const auto found = description_.strings.find(index);
      if (found == description_.strings.end()) return ControlAnswer::stalled();
      std::vector<std::uint8_t> utf16{static_cast<std::uint8_t>(2 + 2 * found->second.size()), kString};
      for (const char c : found->second) {
        utf16.push_back(static_cast<std::uint8_t>(c));
        utf16.push_back(0);
      }
      return {ControlAnswer::Kind::done, std::move(utf16)};
    }
    default:
      return ControlAnswer::stalled();
  }
}

std::optional<ControlAnswer> StandardRequests::answer(const SetupPacket& setup) {
  if ((setup.request_type & kTypeMask) != 0) return std::nullopt;
  using Kind = ControlAnswer::Kind;
  switch (setup.request) {
    case kGetDescriptor:
      return descriptor(setup);
    case kGetStatus:
      return ControlAnswer{Kind::done, {0, 0}};
    case kGetConfiguration:
      return ControlAnswer{Kind::done, {configuration_}};
    case kSetConfiguration:
      if (setup.value > 1) return ControlAnswer::stalled();
      configuration_ = low(setup.value);
      return ControlAnswer{};
    case kGetInterface:
      return ControlAnswer{Kind::done, {0}};
    case kSetInterface:
      return setup.value == 0 ? ControlAnswer{} : ControlAnswer::stalled();
    case kSetAddress:
    case kClearFeature:
    case kSetFeature:
      return ControlAnswer{};
    default:
      return ControlAnswer::stalled();
  }
}

}  // namespace rig::sim::wire
