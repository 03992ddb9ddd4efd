// What a Pololu Tic says and takes: commands, variables, settings and errors, as the Tic's user's guide has
// them. Pure functions over bytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/base/result.h"

namespace rig::drivers::tic {

/// bRequest of a vendor control transfer.
enum class Command : std::uint8_t {
  reinitialize = 0x10,
  set_setting = 0x13,
  exit_safe_start = 0x83,
  energize = 0x85,
  deenergize = 0x86,
  halt_and_hold = 0x89,
  clear_driver_error = 0x8A,
  reset_command_timeout = 0x8C,
  go_home = 0x97,
  get_variable = 0xA1,
  get_variable_and_clear_errors = 0xA2,
  get_setting = 0xA8,
  set_target_position = 0xE0,
  set_target_velocity = 0xE3,
  set_max_speed = 0xE6,
  set_max_decel = 0xE9,
  set_max_accel = 0xEA,
  halt_and_set_position = 0xEC,
};
[[nodiscard]] const char* name_of(Command command);  ///< "go home"

/// Bits of the error variables. Up to err_line_high they are in "error status", what stops the motor now; all
/// are in "errors occurred", what has happened since those were last cleared.
namespace error {
inline constexpr std::uint32_t deenergized = 1U << 0U, motor_driver = 1U << 1U, low_vin = 1U << 2U,
                               kill_switch = 1U << 3U, required_input = 1U << 4U, serial = 1U << 5U,
                               command_timeout = 1U << 6U, safe_start = 1U << 7U, err_line_high = 1U << 8U,
                               serial_framing = 1U << 16U, serial_overrun = 1U << 17U,
                               serial_format = 1U << 18U, serial_crc = 1U << 19U, encoder_skip = 1U << 20U;
/// Those that are faults: not being energised and having to be resumed are none.
inline constexpr std::uint32_t faults =
    motor_driver | low_vin | kill_switch | required_input | serial | command_timeout | err_line_high;
}  // namespace error
/// "low VIN, kill switch active"; bits without a name as "error bit 12". Empty for 0.
[[nodiscard]] std::string error_text(std::uint32_t errors);

enum class Operation : std::uint8_t {
  reset = 0,
  deenergized = 2,
  soft_error = 4,
  waiting_for_err_line = 6,
  starting_up = 8,
  normal = 10,
};
[[nodiscard]] const char* name_of(Operation operation);  ///< "soft error"

enum class Planning : std::uint8_t { off = 0, target_position = 1, target_velocity = 2 };

struct Variables {
  Operation operation = Operation::reset;
  bool energized = false, position_uncertain = true;
  bool forward_limit = false, reverse_limit = false;
  bool homing = false;
  std::uint16_t error_status = 0;
  std::uint32_t errors_occurred = 0;
  Planning planning = Planning::off;
  std::int32_t target_position = 0;  ///< microsteps; of Planning::target_position
  std::int32_t target_velocity = 0;  ///< microsteps/10000 s; of Planning::target_velocity
  std::uint32_t max_speed = 0;       ///< microsteps/10000 s
  std::uint32_t max_decel = 0;       ///< microsteps/s per 100 s
  std::uint32_t max_accel = 0;       ///< microsteps/s per 100 s
  std::int32_t position = 0;         ///< microsteps
  std::int32_t velocity = 0;         ///< microsteps/10000 s
  std::uint16_t vin_mv = 0;
  std::uint8_t step_mode = 0;      ///< code, see products.h
  std::uint8_t current_limit = 0;  ///< code, see products.h

  /// The Tic obeys, or is about to.
  [[nodiscard]] bool runs() const { return operation >= Operation::starting_up; }
};

/// The block is read whole, from offset 0.
inline constexpr std::uint16_t kVariableBytes = 0x55;
/// A block of another length, and one with a value that no Tic has, is `damaged`. Reserved bits may be set:
/// newer firmware may have given them a meaning.
[[nodiscard]] base::Result<Variables> decode_variables(std::span<const std::uint8_t> block);

enum class SoftErrorResponse : std::uint8_t {
  deenergize = 0,
  halt_and_hold = 1,
  decelerate_to_hold = 2,
  go_to_position = 3,
};

struct Settings {
  std::uint8_t control_mode = 0;  ///< 0: Serial / I2C / USB
  bool auto_homing = false;
  bool disable_safe_start = false;
  std::uint16_t command_timeout_ms = 0;  ///< 0: none
  std::uint8_t current_limit = 0;        ///< code, see products.h
  std::uint8_t step_mode = 0;            ///< code, see products.h
  SoftErrorResponse soft_error_response = SoftErrorResponse::decelerate_to_hold;
  std::uint8_t forward_limit_pins = 0, reverse_limit_pins = 0;    ///< bits of the pins
  std::uint32_t homing_speed_towards = 0, homing_speed_away = 0;  ///< microsteps/10000 s
};

/// Offsets of the settings that the driver may write.
inline constexpr std::uint16_t kCommandTimeoutOffset = 0x09, kCurrentLimitOffset = 0x40,
                               kStepModeOffset = 0x41;
inline constexpr std::uint16_t kSettingBytes = 0x69;
/// As decode_variables.
[[nodiscard]] base::Result<Settings> decode_settings(std::span<const std::uint8_t> block);

/// The least firmware that has limit switches and homing, as in bcdDevice.
inline constexpr std::uint16_t kLeastFirmware = 0x0106;
inline constexpr std::uint32_t kMostSpeed = 500'000'000;  ///< microsteps/10000 s
inline constexpr std::uint32_t kLeastAccel = 100;         ///< microsteps/s per 100 s
inline constexpr double kSpeedUnits = 10000;              ///< of a microstep/s
inline constexpr double kAccelUnits = 100;                ///< of a microstep/s^2

}  // namespace rig::drivers::tic
