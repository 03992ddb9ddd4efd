// A CAN bus: whole frames with deadlines, over a SocketCAN interface or, for want of CAN hardware, a unix
// socket that carries the same frames. Classic CAN.
#pragma once

#include <chrono>
#include <linux/can.h>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/base/result.h"

namespace rig::drivers::cia402 {

using Steady = std::chrono::steady_clock;

/// Names its interface in all its errors. An interface that is gone or down answers `lost`; this object is of
/// no more use then.
class CanBus {
 public:
  /// "can0" is a SocketCAN interface; "unix:/path" a SOCK_SEQPACKET socket, each packet one struct can_frame.
  /// Of a SocketCAN interface only the frames with these identifiers (11 bits) are heard, and error frames.
  [[nodiscard]] static base::Result<std::unique_ptr<CanBus>> open(const std::string& interface,
                                                                  std::span<const canid_t> heard);
  ~CanBus();
  CanBus(const CanBus&) = delete;
  CanBus& operator=(const CanBus&) = delete;

  /// Hands a frame to the interface, which sends it when it can. A queue that stays full is `timeout`: nobody
  /// on the bus acknowledges.
  [[nodiscard]] base::Result<void> write(const can_frame& frame, Steady::time_point deadline);
  /// The next frame, error frames included; nothing until the deadline. One in the past does not wait.
  [[nodiscard]] base::Result<std::optional<can_frame>> read(Steady::time_point deadline);

 private:
  CanBus(std::string interface, int fd) : interface_(std::move(interface)), fd_(fd) {}

  const std::string interface_;
  const int fd_;
};

}  // namespace rig::drivers::cia402
