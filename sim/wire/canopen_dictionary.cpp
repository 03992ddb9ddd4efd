#include "sim/wire/canopen_dictionary.h"

namespace rig::sim::wire {

const CanopenDictionary::Entry* CanopenDictionary::find(std::uint16_t index, std::uint8_t sub) const {
  const auto found = entries_.find({index, sub});
  return found == entries_.end() ? nullptr : &found->second;
}

std::uint32_t CanopenDictionary::why_absent(std::uint16_t index) const {
  const auto some = entries_.lower_bound({index, 0});
  return some != entries_.end() && some->first.first == index ? abort_code::kNoSub : abort_code::kNoObject;
}

CanopenDictionary::Read CanopenDictionary::read(std::uint16_t index, std::uint8_t sub) const {
  const Entry* entry = find(index, sub);
  if (entry == nullptr) return {why_absent(index), {}};
  if (entry->access == Access::wo) return {abort_code::kWriteOnly, {}};
  if (!entry->text.empty()) return {0, entry->text};
  const std::uint32_t value = entry->get ? entry->get() : entry->value;
  std::string bytes;
  for (std::size_t i = 0; i < entry->bytes; ++i) bytes.push_back(static_cast<char>(value >> (8 * i) & 0xFFU));
  return {0, bytes};
}

std::uint32_t CanopenDictionary::write(std::uint16_t index, std::uint8_t sub, std::string_view bytes) {
  const auto found = entries_.find({index, sub});
  if (found == entries_.end()) return why_absent(index);
  Entry& entry = found->second;
  if (entry.access == Access::ro || entry.access == Access::constant) return abort_code::kReadOnly;
  if (bytes.size() > entry.bytes) return abort_code::kTooLong;
  if (bytes.size() < entry.bytes) return abort_code::kTooShort;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
  }
  if (entry.set) {
    if (const std::uint32_t abort = entry.set(value); abort != 0) return abort;
  }
  entry.value = value;
  return 0;
}

std::int32_t CanopenDictionary::signed_value(std::uint16_t index, std::uint8_t sub) const {
  const Entry& entry = entries_.at({index, sub});
  switch (entry.bytes) {
    case 1:
      return static_cast<std::int8_t>(entry.value);
    case 2:
      return static_cast<std::int16_t>(entry.value);
    default:
      return static_cast<std::int32_t>(entry.value);
  }
}

}  // namespace rig::sim::wire
