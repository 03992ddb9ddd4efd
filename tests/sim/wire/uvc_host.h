// Requests to a USB video camera as its host makes them, put together from the specification's tables.
#pragma once

#include <gtest/gtest.h>

#include "sim/wire/usb.h"

namespace rig::sim::wire::test {

using Bytes = std::vector<std::uint8_t>;

inline std::uint32_t little(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) value |= static_cast<std::uint32_t>(bytes[i]) << (8 * i);
  return value;
}
inline Bytes little_bytes(std::uint32_t value, std::size_t count) {
  Bytes made(count);
  for (std::size_t i = 0; i < count; ++i) made[i] = static_cast<std::uint8_t>(value >> (8 * i));
  return made;
}

enum Request : std::uint8_t {
  set_cur = 0x01,
  get_cur = 0x81,
  get_min = 0x82,
  get_max = 0x83,
  get_res = 0x84,
  get_len = 0x85,
  get_info = 0x86,
  get_def = 0x87,
};

struct Target {
  std::uint8_t interface, entity, selector;
  std::uint16_t bytes;
};
inline constexpr Target kError{0, 0, 2, 1};
inline constexpr Target kAeMode{0, 1, 2, 1}, kAePriority{0, 1, 3, 1}, kExposure{0, 1, 4, 4};
inline constexpr Target kBrightness{0, 2, 2, 2}, kGain{0, 2, 4, 2};
inline constexpr Target kProbe{1, 0, 1, 34}, kCommit{1, 0, 2, 34}, kStreamError{1, 0, 6, 1};

/// A device's control endpoint; stalls are what the tests are told.
template <typename Device>
struct VideoHost {
  Device& device;

  [[nodiscard]] ControlAnswer ask(Request request, const Target& t) const {
    const auto length = static_cast<std::uint16_t>(request == get_len    ? 2
                                                   : request == get_info ? 1
                                                                         : t.bytes);
    return device.control({0xA1, request, static_cast<std::uint16_t>(t.selector << 8U),
                           static_cast<std::uint16_t>((t.entity << 8U) | t.interface), length},
                          {});
  }
  [[nodiscard]] ControlAnswer tell(const Target& t, const Bytes& data) const {
    return device.control(
        {0x21, set_cur, static_cast<std::uint16_t>(t.selector << 8U),
         static_cast<std::uint16_t>((t.entity << 8U) | t.interface), static_cast<std::uint16_t>(data.size())},
        data);
  }
  /// The number in the answer; -1: it stalled.
  [[nodiscard]] long get(Request request, const Target& t) const {
    const ControlAnswer answer = ask(request, t);
    if (answer.kind != ControlAnswer::Kind::done) return -1;
    const std::size_t wanted = request == get_len ? 2 : request == get_info ? 1 : t.bytes;
    EXPECT_EQ(answer.data.size(), wanted);
    return little(answer.data);
  }
  [[nodiscard]] bool set(const Target& t, std::uint32_t value) const {
    return tell(t, little_bytes(value, t.bytes)).kind == ControlAnswer::Kind::done;
  }
  [[nodiscard]] long error() const { return get(get_cur, kError); }

  /// A probe or commit block for format, frame and interval.
  [[nodiscard]] static Bytes block(std::uint8_t format, std::uint8_t frame, std::uint32_t interval) {
    Bytes b(34);
    b[0] = 1;
    b[2] = format;
    b[3] = frame;
    const Bytes four = little_bytes(interval, 4);
    std::copy(four.begin(), four.end(), b.begin() + 4);
    return b;
  }
  /// As a host starts a stream.
  void start(std::uint8_t format, std::uint8_t frame, std::uint32_t interval) const {
    ASSERT_EQ(tell(kProbe, block(format, frame, interval)).kind, ControlAnswer::Kind::done);
    const ControlAnswer agreed = ask(get_cur, kProbe);
    ASSERT_EQ(agreed.data.size(), 34U);
    ASSERT_EQ(tell(kCommit, agreed.data).kind, ControlAnswer::Kind::done);
  }
  void stop() const { EXPECT_EQ(device.control({0x02, 1, 0, 0x81, 0}, {}).kind, ControlAnswer::Kind::done); }
};
template <typename Device>
VideoHost(Device&) -> VideoHost<Device>;

}  // namespace rig::sim::wire::test
