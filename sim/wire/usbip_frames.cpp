#include "sim/wire/usbip_frames.h"

#include <algorithm>

namespace rig::sim::wire {

namespace {

enum MessageKind : std::uint32_t { kCmdSubmit = 1, kCmdUnlink = 2, kRetSubmit = 3, kRetUnlink = 4 };

// Where the fields stand. The first five are common to all messages.
constexpr std::size_t kCommand = 0, kNumber = 4, kDevice = 8, kDirection = 12, kEndpoint = 16;
constexpr std::size_t kLength = 24, kPackets = 32, kSetup = 40;  // of CMD_SUBMIT
constexpr std::size_t kUnlinked = 20;                            // of CMD_UNLINK
constexpr std::size_t kStatus = 20, kActualLength = 24;  // of RET_SUBMIT; the status of RET_UNLINK too

std::uint32_t read(std::span<const std::uint8_t, kUsbIpHeader> b, std::size_t at) {
  return (static_cast<std::uint32_t>(b[at]) << 24U) | (static_cast<std::uint32_t>(b[at + 1]) << 16U) |
         (static_cast<std::uint32_t>(b[at + 2]) << 8U) | b[at + 3];
}

void write(std::array<std::uint8_t, kUsbIpHeader>& b, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) b[at + i] = static_cast<std::uint8_t>((value >> (24 - 8 * i)) & 0xFFU);
}

}  // namespace

std::optional<UsbIpRequest> parse_usbip(std::span<const std::uint8_t, kUsbIpHeader> header) {
  const std::uint32_t command = read(header, kCommand);
  if (command == kCmdUnlink) {
    return UsbIpRequest{std::nullopt, UsbIpUnlink{read(header, kNumber), read(header, kUnlinked)}};
  }
  if (command != kCmdSubmit) return std::nullopt;
  UsbIpSubmit submit;
  submit.number = read(header, kNumber);
  submit.device = read(header, kDevice);
  submit.in = read(header, kDirection) != 0;
  submit.endpoint = read(header, kEndpoint);
  submit.length = read(header, kLength);
  // Minus one where there are none, says the documentation; the kernel itself sends 0.
  const std::uint32_t packets = read(header, kPackets);
  submit.iso_packets = packets == 0xFFFFFFFF ? 0 : packets;
  std::copy_n(header.begin() + kSetup, submit.setup.size(), submit.setup.begin());
  return UsbIpRequest{submit, std::nullopt};
}

std::array<std::uint8_t, kUsbIpHeader> usbip_ret_submit(std::uint32_t number, std::int32_t status,
                                                        std::uint32_t length) {
  std::array<std::uint8_t, kUsbIpHeader> b{};
  write(b, kCommand, kRetSubmit);
  write(b, kNumber, number);
  write(b, kStatus, static_cast<std::uint32_t>(status));
  write(b, kActualLength, length);
  return b;
}

std::array<std::uint8_t, kUsbIpHeader> usbip_ret_unlink(std::uint32_t number, std::int32_t status) {
  std::array<std::uint8_t, kUsbIpHeader> b{};
  write(b, kCommand, kRetUnlink);
  write(b, kNumber, number);
  write(b, kStatus, static_cast<std::uint32_t>(status));
  return b;
}

}  // namespace rig::sim::wire
