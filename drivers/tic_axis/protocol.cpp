#include "drivers/tic_axis/protocol.h"

#include <array>
#include <cstdlib>

namespace rig::drivers::tic {

using base::ErrorCode;
using base::fail;
using base::Result;
using Block = std::span<const std::uint8_t>;

namespace {

// Offsets of variables.
constexpr std::size_t kOperation = 0x00, kMiscFlags = 0x01, kErrorStatus = 0x02, kErrorsOccurred = 0x04,
                      kPlanningMode = 0x09, kTargetPosition = 0x0A, kTargetVelocity = 0x0E,
                      kMaxSpeedAt = 0x16, kMaxDecelAt = 0x1A, kMaxAccelAt = 0x1E, kPosition = 0x22,
                      kVelocity = 0x26, kVin = 0x33, kStepModeAt = 0x49, kCurrentLimitAt = 0x4A,
                      kInputState = 0x4C;
// Offsets of settings.
constexpr std::size_t kControlMode = 0x01, kOptions = 0x02, kDisableSafeStart = 0x03,
                      kSoftErrorResponse = 0x53, kForwardPins = 0x5F, kReversePins = 0x60,
                      kHomingTowards = 0x61, kHomingAway = 0x65;

struct NamedBit {
  std::uint32_t bit;
  const char* name;
};
constexpr std::array kErrorNames{
    NamedBit{error::deenergized, "intentionally de-energized"},
    NamedBit{error::motor_driver, "motor driver error"},
    NamedBit{error::low_vin, "low VIN"},
    NamedBit{error::kill_switch, "kill switch active"},
    NamedBit{error::required_input, "required input invalid"},
    NamedBit{error::serial, "serial error"},
    NamedBit{error::command_timeout, "command timeout"},
    NamedBit{error::safe_start, "safe start violation"},
    NamedBit{error::err_line_high, "ERR line high"},
    NamedBit{error::serial_framing, "serial framing"},
    NamedBit{error::serial_overrun, "serial RX overrun"},
    NamedBit{error::serial_format, "serial format"},
    NamedBit{error::serial_crc, "serial CRC"},
    NamedBit{error::encoder_skip, "encoder skip"},
};

std::uint16_t read16(Block b, std::size_t at) {
  return static_cast<std::uint16_t>(b[at] | (b[at + 1] << 8U));
}
std::uint32_t read32(Block b, std::size_t at) {
  return read16(b, at) | (static_cast<std::uint32_t>(read16(b, at + 2)) << 16U);
}
std::int32_t read_signed(Block b, std::size_t at) {
  return static_cast<std::int32_t>(read32(b, at));
}
bool bit(std::uint8_t byte, unsigned number) {
  return ((byte >> number) & 1U) != 0;
}

tl::unexpected<base::Error> no_such(const char* what, std::int64_t value) {
  return fail(ErrorCode::damaged, fmt::format("the Tic's answer is garbled: {} {}", what, value));
}

bool is_operation(std::uint8_t value) {
  return value <= static_cast<std::uint8_t>(Operation::normal) && value % 2 == 0;
}

bool is_speed(std::int64_t value) {
  return std::abs(value) <= std::int64_t{kMostSpeed};
}

}  // namespace

const char* name_of(Command command) {
  switch (command) {
    case Command::reinitialize:
      return "reinitialize";
    case Command::set_setting:
      return "set setting";
    case Command::exit_safe_start:
      return "exit safe start";
    case Command::energize:
      return "energize";
    case Command::deenergize:
      return "de-energize";
    case Command::halt_and_hold:
      return "halt and hold";
    case Command::clear_driver_error:
      return "clear driver error";
    case Command::reset_command_timeout:
      return "reset command timeout";
    case Command::go_home:
      return "go home";
    case Command::get_variable:
      return "get variable";
    case Command::get_variable_and_clear_errors:
      return "get variable and clear errors occurred";
    case Command::get_setting:
      return "get setting";
    case Command::set_target_position:
      return "set target position";
    case Command::set_target_velocity:
      return "set target velocity";
    case Command::set_max_speed:
      return "set max speed";
    case Command::set_max_decel:
      return "set max deceleration";
    case Command::set_max_accel:
      return "set max acceleration";
    case Command::halt_and_set_position:
      return "halt and set position";
  }
  return "command";
}

const char* name_of(Operation operation) {
  switch (operation) {
    case Operation::reset:
      return "reset";
    case Operation::deenergized:
      return "de-energized";
    case Operation::soft_error:
      return "soft error";
    case Operation::waiting_for_err_line:
      return "waiting for ERR line";
    case Operation::starting_up:
      return "starting up";
    case Operation::normal:
      return "normal";
  }
  return "unknown";
}

std::string error_text(std::uint32_t errors) {
  std::string text;
  const auto add = [&text](const std::string& name) { text += (text.empty() ? "" : ", ") + name; };
  for (const NamedBit& each : kErrorNames) {
    if ((errors & each.bit) != 0) add(each.name);
    errors &= ~each.bit;
  }
  for (unsigned i = 0; i < 32; ++i) {
    if (((errors >> i) & 1U) != 0) add(fmt::format("error bit {}", i));
  }
  return text;
}

Result<Variables> decode_variables(Block b) {
  if (b.size() != kVariableBytes) {
    return fail(ErrorCode::damaged,
                fmt::format("{} of {} bytes of the Tic's variables", b.size(), kVariableBytes));
  }
  constexpr std::uint8_t kMostPlanning = 2, kMostInputState = 4, kMostStepMode = 9;
  if (!is_operation(b[kOperation])) return no_such("operation state", b[kOperation]);
  if (b[kPlanningMode] > kMostPlanning) return no_such("planning mode", b[kPlanningMode]);
  if (b[kInputState] > kMostInputState) return no_such("input state", b[kInputState]);
  if (b[kStepModeAt] > kMostStepMode) return no_such("step mode", b[kStepModeAt]);
  Variables v;
  v.operation = static_cast<Operation>(b[kOperation]);
  v.energized = bit(b[kMiscFlags], 0);
  v.position_uncertain = bit(b[kMiscFlags], 1);
  v.forward_limit = bit(b[kMiscFlags], 2);
  v.reverse_limit = bit(b[kMiscFlags], 3);
  v.homing = bit(b[kMiscFlags], 4);
  v.error_status = read16(b, kErrorStatus);
  v.errors_occurred = read32(b, kErrorsOccurred);
  v.planning = static_cast<Planning>(b[kPlanningMode]);
  v.target_position = read_signed(b, kTargetPosition);
  v.target_velocity = read_signed(b, kTargetVelocity);
  v.max_speed = read32(b, kMaxSpeedAt);
  v.max_decel = read32(b, kMaxDecelAt);
  v.max_accel = read32(b, kMaxAccelAt);
  v.position = read_signed(b, kPosition);
  v.velocity = read_signed(b, kVelocity);
  v.vin_mv = read16(b, kVin);
  v.step_mode = b[kStepModeAt];
  v.current_limit = b[kCurrentLimitAt];
  if (!is_speed(v.max_speed)) return no_such("max speed", v.max_speed);
  if (!is_speed(v.velocity)) return no_such("velocity", v.velocity);
  return v;
}

Result<Settings> decode_settings(Block b) {
  if (b.size() != kSettingBytes) {
    return fail(ErrorCode::damaged,
                fmt::format("{} of {} bytes of the Tic's settings", b.size(), kSettingBytes));
  }
  constexpr std::uint8_t kMostControlMode = 7, kMostResponse = 3;
  if (b[kControlMode] > kMostControlMode) return no_such("control mode", b[kControlMode]);
  if (b[kSoftErrorResponse] > kMostResponse) return no_such("soft error response", b[kSoftErrorResponse]);
  constexpr unsigned kAutoHoming = 1;
  Settings s;
  s.control_mode = b[kControlMode];
  s.auto_homing = bit(b[kOptions], kAutoHoming);
  s.disable_safe_start = b[kDisableSafeStart] != 0;
  s.command_timeout_ms = read16(b, kCommandTimeoutOffset);
  s.current_limit = b[kCurrentLimitOffset];
  s.step_mode = b[kStepModeOffset];
  s.soft_error_response = static_cast<SoftErrorResponse>(b[kSoftErrorResponse]);
  s.forward_limit_pins = b[kForwardPins];
  s.reverse_limit_pins = b[kReversePins];
  s.homing_speed_towards = read32(b, kHomingTowards);
  s.homing_speed_away = read32(b, kHomingAway);
  return s;
}

}  // namespace rig::drivers::tic
