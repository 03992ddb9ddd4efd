// The messages of USB/IP once a device is attached (Documentation/usb/usbip_protocol.rst of the kernel): 48
// bytes, numbers with the most significant byte first, then the data. The setup packet alone is as on the
// bus.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "sim/wire/usb.h"

namespace rig::sim::wire {

inline constexpr std::size_t kUsbIpHeader = 48;

/// Linux' own error numbers, which the host's kernel gives to whoever waits for the transfer.
namespace usbip_status {
inline constexpr std::int32_t kDone = 0, kStall = -32, kUnlinked = -104, kProtocol = -71;
}  // namespace usbip_status

/// CMD_SUBMIT: the host asks for a transfer.
struct UsbIpSubmit {
  std::uint32_t number = 0;
  std::uint32_t device = 0;
  bool in = false;
  std::uint32_t endpoint = 0;
  std::uint32_t length = 0;       ///< of the buffer; as many bytes follow where the transfer is not `in`
  std::uint32_t iso_packets = 0;  ///< descriptors of 16 bytes that follow; 0 for all but isochronous ones
  std::array<std::uint8_t, 8> setup{};
};

/// CMD_UNLINK: the host does not want that transfer any more.
struct UsbIpUnlink {
  std::uint32_t number = 0;
  std::uint32_t of = 0;
};

struct UsbIpRequest {
  std::optional<UsbIpSubmit> submit;
  std::optional<UsbIpUnlink> unlink;
};

/// Nothing for a message that a host does not send.
[[nodiscard]] std::optional<UsbIpRequest> parse_usbip(std::span<const std::uint8_t, kUsbIpHeader> header);

/// RET_SUBMIT; the data of a transfer towards the host follow it. `length` is what was carried.
[[nodiscard]] std::array<std::uint8_t, kUsbIpHeader> usbip_ret_submit(std::uint32_t number,
                                                                      std::int32_t status,
                                                                      std::uint32_t length);
/// RET_UNLINK: kUnlinked where the transfer was still pending and will not be answered, kDone where it was
/// answered before.
[[nodiscard]] std::array<std::uint8_t, kUsbIpHeader> usbip_ret_unlink(std::uint32_t number,
                                                                      std::int32_t status);

}  // namespace rig::sim::wire
