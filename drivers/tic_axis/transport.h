// Control transfers to one Tic: over USB (usb_transport.h), or over a socket for tests (socket_transport.h).
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "drivers/common/retry.h"

namespace rig::drivers::tic {

struct ControlRequest {
  std::uint8_t type = 0;  ///< bmRequestType
  std::uint8_t request = 0;
  std::uint16_t value = 0, index = 0;
};

/// Who is at the other end.
struct Identity {
  std::uint16_t product = 0;   ///< idProduct
  std::uint16_t firmware = 0;  ///< bcdDevice: 0x0106 is 1.06
  std::string serial;
  std::string where;  ///< "Tic 00123456 at USB 1-1.4", for messages
};

/// One transfer at a time. `lost`: the device is gone, and this transport with it. `timeout`: no answer in
/// time. `damaged`: an answer that is none. `device`: the Tic refused the request (a stall).
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  /// A transfer towards the Tic, without data.
  [[nodiscard]] virtual base::Result<void> control_out(const ControlRequest& request,
                                                       std::chrono::milliseconds within) = 0;
  /// A transfer from the Tic; fewer bytes than asked for are what it had.
  [[nodiscard]] virtual base::Result<std::vector<std::uint8_t>> control_in(
      const ControlRequest& request, std::uint16_t length, std::chrono::milliseconds within) = 0;
  [[nodiscard]] virtual const Identity& identity() const = 0;
};

/// Where a Tic is looked for: by its serial number wherever it is plugged in, or by the port that it is
/// plugged into, whichever it is. One of the two is empty.
struct Place {
  std::string serial;    ///< "00123456"
  std::string usb_path;  ///< "1-1.4": bus and ports, as the kernel names them in /sys/bus/usb/devices
  std::string transport = "usb";  ///< or "unix:PATH", for tests
};

/// Finds the Tic, within the call that it is looked for in. Whatever the error's code, it may come later.
[[nodiscard]] base::Result<std::unique_ptr<Transport>> open_transport(const Place& place,
                                                                      const RetryPolicy& policy,
                                                                      Deadline call_ends = Deadline::max());

}  // namespace rig::drivers::tic
