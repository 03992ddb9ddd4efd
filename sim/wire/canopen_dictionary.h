// The object dictionary of a CANopen device (CiA 301): what may be read and written, and what is refused how.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

namespace rig::sim::wire {

/// Abort codes of CiA 301; 0 is none.
namespace abort_code {
inline constexpr std::uint32_t kToggle = 0x05030000;
inline constexpr std::uint32_t kUnknownCommand = 0x05040001;
inline constexpr std::uint32_t kWriteOnly = 0x06010001;
inline constexpr std::uint32_t kReadOnly = 0x06010002;
inline constexpr std::uint32_t kNoObject = 0x06020000;
inline constexpr std::uint32_t kNotMappable = 0x06040041;
inline constexpr std::uint32_t kTooLong = 0x06070012;
inline constexpr std::uint32_t kTooShort = 0x06070013;
inline constexpr std::uint32_t kNoSub = 0x06090011;
inline constexpr std::uint32_t kOutOfRange = 0x06090030;
inline constexpr std::uint32_t kDeviceState = 0x08000022;
}  // namespace abort_code

class CanopenDictionary {
 public:
  enum class Access { constant, ro, wo, rw };

  struct Entry {
    std::size_t bytes = 4;  ///< 1, 2 or 4; of a text its length does not matter
    Access access = Access::rw;
    std::uint32_t value = 0;  ///< signed ones as their bits
    std::string text = {};    ///< of a visible string; only `constant`
    /// In place of `value`, where it is made when it is read.
    std::function<std::uint32_t()> get = {};
    /// Asked before a new value is kept; its answer is 0 or an abort code.
    std::function<std::uint32_t(std::uint32_t)> set = {};
  };

  void add(std::uint16_t index, std::uint8_t sub, Entry entry) {
    entries_.insert_or_assign({index, sub}, std::move(entry));
  }
  void remove(std::uint16_t index) {
    entries_.erase(entries_.lower_bound({index, 0}), entries_.upper_bound({index, 0xFF}));
  }

  struct Read {
    std::uint32_t abort = 0;
    std::string bytes;
  };
  [[nodiscard]] Read read(std::uint16_t index, std::uint8_t sub) const;
  /// Bytes in the order of the wire; the abort code, or 0.
  [[nodiscard]] std::uint32_t write(std::uint16_t index, std::uint8_t sub, std::string_view bytes);

  /// The device's own view; an entry that is not there is a bug of the device.
  [[nodiscard]] std::uint32_t value(std::uint16_t index, std::uint8_t sub = 0) const {
    return entries_.at({index, sub}).value;
  }
  [[nodiscard]] std::int32_t signed_value(std::uint16_t index, std::uint8_t sub = 0) const;
  void put(std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    entries_.at({index, sub}).value = value;
  }
  [[nodiscard]] const Entry* find(std::uint16_t index, std::uint8_t sub) const;

 private:
  [[nodiscard]] std::uint32_t why_absent(std::uint16_t index) const;

  std::map<std::pair<std::uint16_t, std::uint8_t>, Entry> entries_;
};

}  // namespace rig::sim::wire
