#include "sim/wire/uvc_payload.h"

#include <algorithm>

#include "sim/wire/uvc_request.h"

namespace rig::sim::wire {

std::vector<std::vector<std::uint8_t>> uvc_payloads(std::span<const std::uint8_t> frame,
                                                    const UvcFrameHead& head, std::size_t most) {
  constexpr std::size_t kHeader = 12;
  constexpr unsigned int kOdd = 0x01, kEnd = 0x02, kHasTime = 0x04, kHasClock = 0x08, kError = 0x40,
                         kEndOfHeader = 0x80;
  constexpr std::uint16_t kBusFrames = 0x07FF;
  const std::size_t half = frame.size() / 2, whole = frame.size();
  std::vector<std::vector<std::uint8_t>> payloads;
  std::size_t sent = 0;
  do {
    const std::size_t now = std::min(most - kHeader, whole - sent);
    const bool last = sent + now == whole;
    const bool bad = head.damaged && sent + now > half;
    std::vector<std::uint8_t> payload;
    payload.reserve(kHeader + now);
    uvc_append(payload, kHeader, 1);
    uvc_append(
        payload,
        kHasTime | kHasClock | kEndOfHeader | (head.odd ? kOdd : 0) | (last ? kEnd : 0) | (bad ? kError : 0),
        1);
    uvc_append(payload, head.taken, 4);
    uvc_append(payload, head.sent, 4);
    uvc_append(payload, head.bus_frame & kBusFrames, 2);
    const auto from = frame.subspan(sent, now);
    payload.insert(payload.end(), from.begin(), from.end());
    payloads.push_back(std::move(payload));
    sent += now;
  } while (sent < whole);
  return payloads;
}

}  // namespace rig::sim::wire
