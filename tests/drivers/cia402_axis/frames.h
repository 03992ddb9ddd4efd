// CAN frames as the documents print them.
#pragma once

#include <initializer_list>
#include <linux/can.h>
#include <ostream>

namespace rig::drivers::cia402 {

[[nodiscard]] inline can_frame frame_of(canid_t id, std::initializer_list<int> bytes) {
  can_frame frame{};
  frame.can_id = id;
  for (const int byte : bytes) frame.data[frame.can_dlc++] = static_cast<std::uint8_t>(byte);
  return frame;
}

}  // namespace rig::drivers::cia402

inline bool operator==(const can_frame& a, const can_frame& b) {
  if (a.can_id != b.can_id || a.can_dlc != b.can_dlc) return false;
  for (int i = 0; i < a.can_dlc; ++i) {
    if (a.data[i] != b.data[i]) return false;
  }
  return true;
}

// GoogleTest's name.  NOLINTNEXTLINE(readability-identifier-naming)
inline void PrintTo(const can_frame& frame, std::ostream* out) {
  constexpr char kHex[] = "0123456789ABCDEF";
  *out << std::hex << frame.can_id << std::dec << "#";
  for (int i = 0; i < frame.can_dlc; ++i) *out << kHex[frame.data[i] >> 4] << kHex[frame.data[i] & 15];
}
