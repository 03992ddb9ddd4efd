// Modbus from the slave's side: checksums, requests and answers as bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rig::sim::wire {

/// Of the serial protocol: polynomial 0xA001 reflected, begun with 0xFFFF; its low byte goes first.
[[nodiscard]] std::uint16_t modbus_crc(std::string_view bytes);
/// The bytes with their checksum behind them.
[[nodiscard]] std::string with_modbus_crc(std::string_view bytes);
/// Whether the last two bytes are the checksum of those before.
[[nodiscard]] bool modbus_crc_fits(std::string_view frame);

/// Exception codes of the protocol.
enum class ModbusException : std::uint8_t {
  illegal_function = 1,
  illegal_address = 2,
  illegal_value = 3,
  device_failure = 4,
  busy = 6,
  bad_checksum = 8,  ///< Leadshine's use of the code
};

/// What stands behind one slave number.
class ModbusRegisters {
 public:
  using Words = std::vector<std::uint16_t>;
  ModbusRegisters() = default;
  ModbusRegisters(const ModbusRegisters&) = delete;
  ModbusRegisters& operator=(const ModbusRegisters&) = delete;
  virtual ~ModbusRegisters() = default;

  /// Nothing where one of them does not exist. `input`: function 04 asked.
  [[nodiscard]] virtual std::optional<Words> read(bool input, std::uint16_t address, std::size_t count) = 0;
  /// Nothing: done.
  [[nodiscard]] virtual std::optional<ModbusException> write(std::uint16_t address, const Words& words) = 0;
  /// A request whose checksum is wrong is answered with exception 8, where others stay silent.
  [[nodiscard]] virtual bool tells_bad_checksum() const { return false; }
};

/// How long the request (function code and what follows, no address, no checksum) is that begins so; nothing
/// while too little of it is there, or for functions that these devices do not know.
[[nodiscard]] std::optional<std::size_t> modbus_request_length(std::string_view pdu);

/// The answer to a request: functions 03, 04, 06 and 16; whatever does not fit them is an exception.
[[nodiscard]] std::string modbus_answer(ModbusRegisters& registers, std::string_view pdu);
[[nodiscard]] std::string modbus_exception(char function, ModbusException code);

}  // namespace rig::sim::wire
