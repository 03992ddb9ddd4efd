#include "sim/wire/uvc_request.h"

namespace rig::sim::wire {

void uvc_append(std::vector<std::uint8_t>& to, std::uint64_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) to.push_back(static_cast<std::uint8_t>((value >> (8 * i)) & 0xFFU));
}

std::uint32_t uvc_number(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = bytes.size(); i > 0; --i) value = (value << 8U) | bytes[i - 1];
  return value;
}

}  // namespace rig::sim::wire
