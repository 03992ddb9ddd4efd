#include "drivers/cia402_axis/statusword.h"

namespace rig::drivers::cia402 {

Power power_of(std::uint16_t statusword) {
  // Bit 5 (quick stop) does not matter in the four states that are told apart without it.
  switch (statusword & 0x4FU) {
    case 0x40:
      return Power::switch_on_disabled;
    case 0x0F:
      return Power::fault_reaction;
    case 0x08:
      return Power::fault;
    default:
      break;
  }
  switch (statusword & 0x6FU) {
    case 0x21:
      return Power::ready;
    case 0x23:
      return Power::switched_on;
    case 0x27:
      return Power::operation_enabled;
    case 0x07:
      return Power::quick_stop;
    default:
      return Power::not_ready;
  }
}

const char* text_of(Power power) {
  switch (power) {
    case Power::not_ready:
      return "not ready to switch on";
    case Power::switch_on_disabled:
      return "switch on disabled";
    case Power::ready:
      return "ready to switch on";
    case Power::switched_on:
      return "switched on";
    case Power::operation_enabled:
      return "operation enabled";
    case Power::quick_stop:
      return "quick stop active";
    case Power::fault_reaction:
      return "fault reaction active";
    case Power::fault:
      return "fault";
  }
  return "unknown";
}

std::optional<std::uint16_t> towards_operation(Power power, bool stays) {
  switch (power) {
    case Power::switch_on_disabled:
      return control::kShutdown;
    case Power::ready:
      return control::kSwitchOn;
    case Power::switched_on:
      return control::kEnableOperation;
    case Power::quick_stop:
      if (stays) return control::kEnableOperation;
      return std::nullopt;
    case Power::not_ready:
    case Power::operation_enabled:
    case Power::fault_reaction:
    case Power::fault:
      return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace rig::drivers::cia402
