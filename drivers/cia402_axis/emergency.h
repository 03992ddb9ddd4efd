// Error codes of CiA 301 and CiA 402 in words.
#pragma once

#include <cstdint>
#include <string>

namespace rig::drivers::cia402 {

/// What an emergency object told (CiA 301).
struct Emergency {
  std::uint16_t code = 0;           ///< as in object 603F; 0: the errors are gone
  std::uint8_t error_register = 0;  ///< as object 1001
};

/// "following error"; the class of a code that has no name of its own ("temperature of the drive").
[[nodiscard]] std::string text_of_error_code(std::uint16_t code);

/// "temperature of the motor (0x4110, error register 0x09)".
[[nodiscard]] std::string text_of(const Emergency& emergency);

/// Whether a fault of this code says that the drive no longer knows its position: the sensors (73xx).
[[nodiscard]] bool loses_reference(std::uint16_t code);

}  // namespace rig::drivers::cia402
