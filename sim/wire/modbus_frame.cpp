#include "sim/wire/modbus_frame.h"

namespace rig::sim::wire {

namespace {

constexpr char kReadHolding = 3, kReadInput = 4, kWriteSingle = 6, kWriteMultiple = 16;
constexpr std::size_t kMostRead = 125, kMostWritten = 123;

std::uint16_t word_at(std::string_view bytes, std::size_t at) {
  const auto high = static_cast<unsigned char>(bytes[at]), low = static_cast<unsigned char>(bytes[at + 1]);
  return static_cast<std::uint16_t>(high << 8 | low);
}

void append(std::string& bytes, std::uint16_t word) {
  bytes += static_cast<char>(word >> 8);
  bytes += static_cast<char>(word & 0xFF);
}

}  // namespace

std::uint16_t modbus_crc(std::string_view bytes) {
  std::uint16_t crc = 0xFFFF;
  for (const char byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ static_cast<unsigned char>(byte));
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = (crc & 1) != 0;
      crc = static_cast<std::uint16_t>(crc >> 1);
      if (carry) crc = static_cast<std::uint16_t>(crc ^ 0xA001);
    }
  }
  return crc;
}

std::string with_modbus_crc(std::string_view bytes) {
  const std::uint16_t crc = modbus_crc(bytes);
  std::string frame(bytes);
  frame += static_cast<char>(crc & 0xFF);
  frame += static_cast<char>(crc >> 8);
  return frame;
}

bool modbus_crc_fits(std::string_view frame) {
  return frame.size() > 2 && with_modbus_crc(frame.substr(0, frame.size() - 2)) == frame;
}

std::optional<std::size_t> modbus_request_length(std::string_view pdu) {
  if (pdu.empty()) return std::nullopt;
  switch (pdu[0]) {
    case kReadHolding:
    case kReadInput:
    case kWriteSingle:
      return 5;
    case kWriteMultiple:
      if (pdu.size() < 6) return std::nullopt;
      return 6 + static_cast<std::size_t>(static_cast<unsigned char>(pdu[5]));
    default:
      return std::nullopt;
  }
}

std::string modbus_exception(char function, ModbusException code) {
  return {static_cast<char>(function | 0x80), static_cast<char>(code)};
}

std::string modbus_answer(ModbusRegisters& registers, std::string_view pdu) {
  const char function = pdu[0];
  const auto length = modbus_request_length(pdu);
  const bool known = function == kReadHolding || function == kReadInput || function == kWriteSingle ||
                     function == kWriteMultiple;
  if (!known) return modbus_exception(function, ModbusException::illegal_function);
  if (!length || *length != pdu.size()) return modbus_exception(function, ModbusException::illegal_value);
  const std::uint16_t address = word_at(pdu, 1), number = word_at(pdu, 3);
  if (function == kReadHolding || function == kReadInput) {
    if (number == 0 || number > kMostRead) return modbus_exception(function, ModbusException::illegal_value);
    const auto words = registers.read(function == kReadInput, address, number);
    if (!words) return modbus_exception(function, ModbusException::illegal_address);
    std::string answer{function, static_cast<char>(2 * number)};
    for (const std::uint16_t word : *words) append(answer, word);
    return answer;
  }
  ModbusRegisters::Words words{number};
  if (function == kWriteMultiple) {
    if (number == 0 || number > kMostWritten || pdu.size() != 6U + 2U * number) {
      return modbus_exception(function, ModbusException::illegal_value);
    }
    words.clear();
    for (std::size_t i = 0; i < number; ++i) words.push_back(word_at(pdu, 6 + 2 * i));
  }
  if (const auto refused = registers.write(address, words)) return modbus_exception(function, *refused);
  return std::string(pdu.substr(0, 5));
}

}  // namespace rig::sim::wire
