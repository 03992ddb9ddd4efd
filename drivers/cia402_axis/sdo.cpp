#include "drivers/cia402_axis/sdo.h"

#include <algorithm>

namespace rig::drivers::cia402 {

namespace {

constexpr canid_t kToServer = 0x600, kFromServer = 0x580;
constexpr std::size_t kFrameBytes = 8;
// What is read in segments are names; more is a node that counts wrong.
constexpr std::size_t kMost = 4096;

// The command that the three highest bits of the first byte are, from the server.
enum Command : unsigned { kUploadSegment = 0, kDownloadSegment = 1, kUpload = 2, kDownload = 3, kAbort = 4 };

std::uint32_t code_in(const can_frame& frame) {
  std::uint32_t code = 0;
  for (std::size_t i = 0; i < 4; ++i) code |= static_cast<std::uint32_t>(frame.data[4 + i]) << (8 * i);
  return code;
}

base::ErrorCode kind_of(std::uint32_t code) {
  switch (code) {
    case abort_code::kNoObject:
    case abort_code::kNoSub:
      return base::ErrorCode::not_found;
    case abort_code::kToggle:
    case abort_code::kTimedOut:
    case abort_code::kUnknownCommand:
      return base::ErrorCode::damaged;
    default:
      return base::ErrorCode::device;
  }
}

void append(std::string& to, const can_frame& frame, std::size_t from, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to.push_back(static_cast<char>(frame.data[from + i]));
}

}  // namespace

std::string text_of(Object object) {
  return fmt::format("{:04X}:{}", object.index, object.sub);
}

SdoTransfer::SdoTransfer(int node, Object object, bool is_upload)
    : node_(node), object_(object), is_upload_(is_upload) {}

SdoTransfer SdoTransfer::upload(int node, Object object) {
  SdoTransfer transfer(node, object, true);
  transfer.request_ = transfer.fresh();
  transfer.request_.data[0] = 0x40;
  return transfer;
}

SdoTransfer SdoTransfer::download(int node, Object object, std::string_view bytes) {
  SdoTransfer transfer(node, object, false);
  transfer.request_ = transfer.fresh();
  const std::size_t count = std::clamp<std::size_t>(bytes.size(), 1, 4);
  transfer.request_.data[0] = static_cast<std::uint8_t>(0x23 | (4 - count) << 2U);
  for (std::size_t i = 0; i < std::min(count, bytes.size()); ++i) {
    transfer.request_.data[4 + i] = static_cast<std::uint8_t>(bytes[i]);
  }
  return transfer;
}

can_frame SdoTransfer::fresh() const {
  can_frame frame{};
  frame.can_id = kToServer + static_cast<canid_t>(node_);
  frame.can_dlc = kFrameBytes;
  frame.data[1] = static_cast<std::uint8_t>(object_.index & 0xFFU);
  frame.data[2] = static_cast<std::uint8_t>(object_.index >> 8U);
  frame.data[3] = object_.sub;
  return frame;
}

bool SdoTransfer::names_object(const can_frame& frame) const {
  return object_ == Object{static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8U), frame.data[3]};
}

can_frame SdoTransfer::abort(std::uint32_t code) const {
  can_frame frame = fresh();
  frame.data[0] = 0x80;
  for (std::size_t i = 0; i < 4; ++i) frame.data[4 + i] = static_cast<std::uint8_t>(code >> (8 * i));
  return frame;
}

std::optional<can_frame> SdoTransfer::hear(const can_frame& frame) {
  if (state_ != State::waiting || frame.can_id != kFromServer + static_cast<canid_t>(node_)) {
    return std::nullopt;
  }
  if (frame.can_dlc != kFrameBytes) {
    saw_garbage_ = true;
    return std::nullopt;
  }
  const unsigned command = frame.data[0] >> 5U;
  switch (command) {
    case kAbort:
      if (!names_object(frame)) return std::nullopt;
      aborted_with_ = code_in(frame);
      state_ = State::failed;
      error_ = {kind_of(*aborted_with_),
                fmt::format("{}: the drive refuses: {} (0x{:08X})", text_of(object_),
                            text_of_abort(*aborted_with_), *aborted_with_),
                {},
                {}};
      return std::nullopt;
    case kUpload:
      if (!names_object(frame) || !is_upload_ || in_segments_) return std::nullopt;
      return begin_upload(frame);
    case kDownload:
      if (names_object(frame) && !is_upload_) state_ = State::done;
      return std::nullopt;
    case kUploadSegment:
      if (!in_segments_) return std::nullopt;
      return take_segment(frame);
    case kDownloadSegment:
      return std::nullopt;
    default:
      saw_garbage_ = true;
      return std::nullopt;
  }
}

std::optional<can_frame> SdoTransfer::begin_upload(const can_frame& frame) {
  const bool expedited = (frame.data[0] & 0x02U) != 0, says_size = (frame.data[0] & 0x01U) != 0;
  if (expedited) {
    // Where it does not say how many of the four are the value, the reader takes what it needs.
    const std::size_t count = says_size ? 4 - ((frame.data[0] >> 2U) & 0x03U) : 4;
    append(bytes_, frame, 4, count);
    state_ = State::done;
    return std::nullopt;
  }
  if (says_size) {
    announced_ = code_in(frame);
    if (*announced_ > kMost) {
      return fail(abort_code::kOutOfMemory, fmt::format("announces {} bytes", *announced_));
    }
  }
  in_segments_ = true;
  return ask_segment();
}

can_frame SdoTransfer::ask_segment() const {
  can_frame frame{};
  frame.can_id = kToServer + static_cast<canid_t>(node_);
  frame.can_dlc = kFrameBytes;
  frame.data[0] = static_cast<std::uint8_t>(0x60 | (toggle_ ? 0x10 : 0));
  return frame;
}

std::optional<can_frame> SdoTransfer::take_segment(const can_frame& frame) {
  if (((frame.data[0] & 0x10U) != 0) != toggle_) {
    return fail(abort_code::kToggle, "the toggle bit of a segment is wrong");
  }
  append(bytes_, frame, 1, 7 - ((frame.data[0] >> 1U) & 0x07U));
  if (bytes_.size() > announced_.value_or(kMost)) {
    return fail(abort_code::kOutOfMemory, "more bytes come than were announced");
  }
  if ((frame.data[0] & 0x01U) == 0) {
    toggle_ = !toggle_;
    return ask_segment();
  }
  if (announced_ && bytes_.size() != *announced_) {
    return fail(abort_code::kGeneral, fmt::format("{} bytes instead of {}", bytes_.size(), *announced_));
  }
  state_ = State::done;
  return std::nullopt;
}

std::optional<can_frame> SdoTransfer::fail(std::uint32_t code, std::string what) {
  state_ = State::failed;
  error_ = {base::ErrorCode::damaged, fmt::format("{}: {}", text_of(object_), what), {}, {}};
  return abort(code);
}

}  // namespace rig::drivers::cia402
