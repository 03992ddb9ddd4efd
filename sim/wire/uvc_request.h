// Class requests of a USB video device (UVC 1.1, 4.1 to 4.3): their codes, and what a unit says to one.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace rig::sim::wire {

/// bRequest (A.8).
namespace uvc_request {
inline constexpr std::uint8_t kSetCur = 0x01, kGetCur = 0x81, kGetMin = 0x82, kGetMax = 0x83, kGetRes = 0x84,
                              kGetLen = 0x85, kGetInfo = 0x86, kGetDef = 0x87;
}  // namespace uvc_request

/// What VC_REQUEST_ERROR_CODE_CONTROL says after a request that stalled (4.2.1.2).
enum class UvcError : std::uint8_t {
  none = 0x00,
  not_ready = 0x01,
  wrong_state = 0x02,
  power = 0x03,
  out_of_range = 0x04,
  invalid_unit = 0x05,
  invalid_control = 0x06,
  invalid_request = 0x07,
  unknown = 0xFF,
};

struct UvcReply {
  UvcError error = UvcError::none;  ///< anything else: the request stalls
  std::vector<std::uint8_t> data = {};

  [[nodiscard]] static UvcReply refused(UvcError error) { return {error, {}}; }
  [[nodiscard]] static UvcReply with(std::vector<std::uint8_t> data) {
    return {UvcError::none, std::move(data)};
  }
};

/// Numbers as USB has them, the least significant byte first.
void uvc_append(std::vector<std::uint8_t>& to, std::uint64_t value, std::size_t bytes);
[[nodiscard]] std::uint32_t uvc_number(std::span<const std::uint8_t> bytes);

}  // namespace rig::sim::wire
