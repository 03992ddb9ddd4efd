// What a CAN controller says of its bus, in the error frames of SocketCAN.
#pragma once

#include <linux/can.h>
#include <string>

namespace rig::drivers::cia402 {

enum class BusEvent {
  nothing,    ///< no error frame, or one that says nothing of the state
  bus_off,    ///< the controller has left the bus and sends nothing more until it is restarted
  restarted,  ///< it is back
  warning,    ///< many errors, or frames lost; it still takes part
};

struct BusNews {
  BusEvent event = BusEvent::nothing;
  std::string text;  ///< for a person; empty for `nothing`
};

/// Of any frame whatever.
[[nodiscard]] BusNews read_error_frame(const can_frame& frame);

}  // namespace rig::drivers::cia402
