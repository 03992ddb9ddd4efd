#include "sim/wire/uvc_negotiation.h"

#include <algorithm>

namespace rig::sim::wire {

namespace {

constexpr std::size_t kFormatAt = 2, kFrameAt = 3, kIntervalAt = 4;

std::vector<std::uint8_t> block_of(const UvcStreamChoice& choice) {
  std::vector<std::uint8_t> b;
  uvc_append(b, 1, 2);  // bmHint: the interval is to be kept
  uvc_append(b, choice.format, 1);
  uvc_append(b, choice.frame, 1);
  uvc_append(b, choice.interval, 4);
  constexpr std::size_t kOfCompression = 8;
  uvc_append(b, 0, kOfCompression);
  uvc_append(b, 0, 2);  // wDelay
  uvc_append(b, uvc_frame_bytes(choice.pixels(), choice.size()), 4);
  uvc_append(b, kUvcMostPayload, 4);
  uvc_append(b, kUvcClock_hz, 4);
  uvc_append(b, 0x03, 1);  // bmFramingInfo: the headers tell frames apart, and their ends
  uvc_append(b, 0, 3);     // versions of a payload that has none
  return b;
}

UvcStreamChoice nearest(std::span<const std::uint8_t> block) {
  UvcStreamChoice choice;
  const std::uint8_t format = block[kFormatAt], frame = block[kFrameAt];
  if (format >= 1 && format <= kUvcFormats.size()) choice.format = format;
  if (frame >= 1 && frame <= kUvcSizes.size()) choice.frame = frame;
  const std::uint32_t wanted = uvc_number(block.subspan(kIntervalAt, 4));
  const auto distance = [&](std::uint32_t each) { return each > wanted ? each - wanted : wanted - each; };
  if (wanted != 0) {
    choice.interval =
        *std::min_element(kUvcIntervals.begin(), kUvcIntervals.end(),
                          [&](std::uint32_t a, std::uint32_t b) { return distance(a) < distance(b); });
  }
  return choice;
}

bool says(std::span<const std::uint8_t> block, const UvcStreamChoice& choice) {
  return block[kFormatAt] == choice.format && block[kFrameAt] == choice.frame &&
         uvc_number(block.subspan(kIntervalAt, 4)) == choice.interval;
}

UvcStreamChoice extreme(const UvcStreamChoice& of, std::uint32_t interval) {
  return {of.format, of.frame, interval};
}

}  // namespace

UvcReply UvcNegotiation::answer(const SetupPacket& setup, std::span<const std::uint8_t> out) {
  const auto selector = static_cast<std::uint8_t>(setup.value >> 8U);
  const bool commit = selector == kCommitControl;
  if ((!commit && selector != kProbeControl) || (setup.value & 0xFFU) != 0) {
    return UvcReply::refused(UvcError::invalid_control);
  }
  const auto invalid = [] { return UvcReply::refused(UvcError::invalid_request); };
  if (setup.is_in() != (setup.request != uvc_request::kSetCur)) return invalid();
  constexpr std::uint8_t kGetAndSet = 3;
  switch (setup.request) {
    case uvc_request::kSetCur:
      if (out.size() != kUvcProbe) return invalid();
      if (!commit) {
        probed_ = nearest(out);
        return {};
      }
      if (!says(out, probed_)) return UvcReply::refused(UvcError::out_of_range);
      committed_ = probed_;
      return {};
    case uvc_request::kGetCur:
      return UvcReply::with(block_of(commit ? committed_ : probed_));
    case uvc_request::kGetMin:
      return commit ? invalid() : UvcReply::with(block_of(extreme(probed_, kUvcIntervals.front())));
    case uvc_request::kGetMax:
      return commit ? invalid() : UvcReply::with(block_of(extreme(probed_, kUvcIntervals.back())));
    case uvc_request::kGetDef:
      return commit ? invalid() : UvcReply::with(block_of({}));
    case uvc_request::kGetLen:
      return UvcReply::with({kUvcProbe, 0});
    case uvc_request::kGetInfo:
      return UvcReply::with({kGetAndSet});
    default:
      return invalid();
  }
}

}  // namespace rig::sim::wire
