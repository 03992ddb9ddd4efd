#include "drivers/cia402_axis/emergency.h"

#include <array>
#include <fmt/format.h>

namespace rig::drivers::cia402 {

namespace {

struct Named {
  std::uint16_t code;
  std::uint16_t mask;  ///< the bits of a code that have to be these
  const char* text;
};

// The first that fits: the particular before the general.
constexpr std::array kNames{
    Named{0x0000, 0xFF00, "no error"},
    Named{0x2310, 0xFFF0, "continuous overcurrent at the output"},
    Named{0x2320, 0xFFF0, "short circuit at the output"},
    Named{0x2330, 0xFFF0, "earth fault at the output"},
    Named{0x2340, 0xFFF0, "short circuit between phases"},
    Named{0x2350, 0xFFF0, "overload (I2t)"},
    Named{0x2100, 0xFF00, "current at the mains side"},
    Named{0x2200, 0xFF00, "current inside the drive"},
    Named{0x2300, 0xFF00, "current at the output"},
    Named{0x2000, 0xF000, "current"},
    Named{0x3110, 0xFFF0, "mains overvoltage"},
    Named{0x3120, 0xFFF0, "mains undervoltage"},
    Named{0x3130, 0xFFF0, "phase failure"},
    Named{0x3210, 0xFFF0, "overvoltage inside the drive"},
    Named{0x3220, 0xFFF0, "undervoltage inside the drive"},
    Named{0x3300, 0xFF00, "voltage at the output"},
    Named{0x3000, 0xF000, "voltage"},
    Named{0x4110, 0xFFF0, "surroundings too hot"},
    Named{0x4120, 0xFFF0, "surroundings too cold"},
    Named{0x4210, 0xFFF0, "drive too hot"},
    Named{0x4220, 0xFFF0, "drive too cold"},
    Named{0x4310, 0xFFFF, "drive too hot"},
    Named{0x4000, 0xF000, "temperature"},
    Named{0x5110, 0xFFF0, "low control supply"},
    Named{0x5400, 0xFF00, "power section"},
    Named{0x5500, 0xFF00, "data storage of the drive"},
    Named{0x5000, 0xF000, "hardware of the drive"},
    Named{0x6010, 0xFFFF, "watchdog of the drive's software"},
    Named{0x6300, 0xFF00, "parameters of the drive"},
    Named{0x6000, 0xF000, "software of the drive"},
    Named{0x7110, 0xFFF0, "brake chopper"},
    Named{0x7120, 0xFFFF, "motor"},
    Named{0x7121, 0xFFFF, "motor blocked"},
    Named{0x7122, 0xFFFF, "motor error or wrong commutation"},
    Named{0x7100, 0xFF00, "power accessories"},
    Named{0x7303, 0xFFFF, "resolver"},
    Named{0x7305, 0xFFFF, "encoder 1"},
    Named{0x7306, 0xFFFF, "encoder 2"},
    Named{0x7300, 0xFF00, "position sensor"},
    Named{0x7400, 0xFF00, "computation circuit"},
    Named{0x7500, 0xFF00, "communication of the drive"},
    Named{0x7000, 0xF000, "additional module"},
    Named{0x8110, 0xFFFF, "CAN overrun, frames lost"},
    Named{0x8120, 0xFFFF, "CAN error-passive"},
    Named{0x8130, 0xFFFF, "heartbeat or life guard missed by the drive"},
    Named{0x8140, 0xFFFF, "recovered from bus-off"},
    Named{0x8150, 0xFFFF, "CAN identifier collision"},
    Named{0x8100, 0xFF00, "communication"},
    Named{0x8210, 0xFFFF, "PDO not processed: wrong length"},
    Named{0x8220, 0xFFFF, "PDO too long"},
    Named{0x8200, 0xFF00, "protocol"},
    Named{0x8300, 0xFF00, "torque control"},
    Named{0x8400, 0xFF00, "velocity control"},
    Named{0x8500, 0xFF00, "position control"},
    Named{0x8611, 0xFFFF, "following error"},
    Named{0x8612, 0xFFFF, "reference limit"},
    Named{0x8600, 0xFF00, "positioning"},
    Named{0x8000, 0xF000, "monitoring"},
    Named{0x9000, 0xF000, "external error"},
    Named{0xF000, 0xFF00, "additional functions"},
    Named{0xFF00, 0xFF00, "the maker's own, see the drive's manual"},
    Named{0x1000, 0xF000, "generic error"},
};

}  // namespace

std::string text_of_error_code(std::uint16_t code) {
  for (const Named& named : kNames) {
    if ((code & named.mask) == named.code) return named.text;
  }
  return "unknown error";
}

std::string text_of(const Emergency& emergency) {
  return fmt::format("{} (0x{:04X}, error register 0x{:02X})", text_of_error_code(emergency.code),
                     emergency.code, emergency.error_register);
}

bool loses_reference(std::uint16_t code) {
  return (code & 0xFF00U) == 0x7300U;
}

}  // namespace rig::drivers::cia402
