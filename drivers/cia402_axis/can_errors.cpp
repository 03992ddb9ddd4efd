#include "drivers/cia402_axis/can_errors.h"

#include <linux/can/error.h>

namespace rig::drivers::cia402 {

BusNews read_error_frame(const can_frame& frame) {
  if ((frame.can_id & CAN_ERR_FLAG) == 0 || frame.can_dlc != CAN_ERR_DLC) return {};
  // A controller that has just been restarted may say in the same frame why it had left.
  if ((frame.can_id & CAN_ERR_RESTARTED) != 0) return {BusEvent::restarted, "the controller was restarted"};
  if ((frame.can_id & CAN_ERR_BUSOFF) != 0) {
    return {BusEvent::bus_off, "the controller is bus-off: too many errors"};
  }
  if ((frame.can_id & CAN_ERR_CRTL) != 0) {
    const unsigned state = frame.data[1];
    if ((state & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) {
      return {BusEvent::warning, "the controller is error-passive: most frames fail"};
    }
    if ((state & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) != 0) {
      return {BusEvent::warning, "the controller lost frames: its buffer overflowed"};
    }
    if ((state & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0) {
      return {BusEvent::warning, "the controller counts many errors"};
    }
  }
  if ((frame.can_id & CAN_ERR_TX_TIMEOUT) != 0)
    return {BusEvent::warning, "a frame could not be sent in time"};
  if ((frame.can_id & CAN_ERR_ACK) != 0) return {BusEvent::warning, "nobody acknowledges a frame"};
  return {};
}

}  // namespace rig::drivers::cia402
