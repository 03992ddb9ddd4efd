// A USB device in user space, at the device's end of a USB/IP connection: the kernel's virtual host
// controller (vhci.h), or a test, has the other. Control transfers go to a handler; bulk and interrupt
// endpoints may be offered beside it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "sim/wire/usb.h"

namespace rig::sim::wire {

/// Serves one connection from a thread of its own. What it is asked for, standard requests included
/// (StandardRequests), goes to the handlers, which are called from that thread.
class UsbIpDevice {
 public:
  /// Data that the host sent to a bulk or interrupt endpoint. False: the endpoint stalls.
  using OutHandler = std::function<bool(std::uint8_t endpoint, std::span<const std::uint8_t> data)>;

  /// Owns `socket`, a stream. Endpoints towards the host are those that data are sent on; a transfer from one
  /// without data waits.
  UsbIpDevice(int socket, ControlHandler control, OutHandler out = {});
  ~UsbIpDevice();  ///< Hangs up.
  UsbIpDevice(const UsbIpDevice&) = delete;
  UsbIpDevice& operator=(const UsbIpDevice&) = delete;

  /// For the host's next transfers from that endpoint, in order; `endpoint` without its direction bit. More
  /// than the host has room for goes into its following transfer. Any thread.
  void send(std::uint8_t endpoint, std::vector<std::uint8_t> data);
  /// How much of what was sent the host has not fetched yet: so many calls of send(). Any thread.
  [[nodiscard]] std::size_t unfetched(std::uint8_t endpoint) const;
  /// What the host has not fetched yet it will not get. Any thread.
  void forget(std::uint8_t endpoint);
  /// The host has hung up, or said what no host says.
  [[nodiscard]] bool ended() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rig::sim::wire
