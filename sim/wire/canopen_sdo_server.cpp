#include "sim/wire/canopen_sdo_server.h"

#include <algorithm>

namespace rig::sim::wire {

can_frame CanopenSdoServer::fresh(std::uint8_t command, std::uint16_t index, std::uint8_t sub) const {
  can_frame frame{};
  frame.can_id = 0x580 + node_;
  frame.can_dlc = 8;
  frame.data[0] = command;
  frame.data[1] = static_cast<std::uint8_t>(index & 0xFFU);
  frame.data[2] = static_cast<std::uint8_t>(index >> 8U);
  frame.data[3] = sub;
  return frame;
}

can_frame CanopenSdoServer::abort(std::uint32_t code, std::uint16_t index, std::uint8_t sub) {
  upload_.reset();
  can_frame frame = fresh(0x80, index, sub);
  for (unsigned i = 0; i < 4; ++i) frame.data[4 + i] = static_cast<std::uint8_t>(code >> (8 * i));
  return frame;
}

std::optional<can_frame> CanopenSdoServer::answer(const can_frame& frame) {
  if (frame.can_id != 0x600 + node_ || frame.can_dlc != 8) return std::nullopt;
  const auto index = static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8U);
  const std::uint8_t sub = frame.data[3];
  switch (frame.data[0] >> 5U) {
    case 1:
      return download(frame, index, sub);
    case 2:
      return begin_upload(index, sub);
    case 3:
      return next_segment(frame);
    case 4:
      upload_.reset();
      return std::nullopt;
    default:
      return abort(abort_code::kUnknownCommand, index, sub);
  }
}

can_frame CanopenSdoServer::begin_upload(std::uint16_t index, std::uint8_t sub) {
  upload_.reset();  // a client that begins anew has given up what it had begun
  const auto read = dictionary_.read(index, sub);
  if (read.abort != 0) return abort(read.abort, index, sub);
  const std::size_t count = read.bytes.size();
  if (count >= 1 && count <= 4) {
    can_frame frame = fresh(static_cast<std::uint8_t>(0x43 | (4 - count) << 2U), index, sub);
    for (std::size_t i = 0; i < count; ++i) frame.data[4 + i] = static_cast<std::uint8_t>(read.bytes[i]);
    return frame;
  }
  upload_ = Upload{index, sub, read.bytes};
  can_frame frame = fresh(0x41, index, sub);
  for (unsigned i = 0; i < 4; ++i) frame.data[4 + i] = static_cast<std::uint8_t>(count >> (8 * i) & 0xFFU);
  return frame;
}

can_frame CanopenSdoServer::next_segment(const can_frame& frame) {
  if (!upload_) return abort(abort_code::kUnknownCommand, 0, 0);
  Upload& upload = *upload_;
  if (((frame.data[0] & 0x10U) != 0) != upload.toggle)
    return abort(abort_code::kToggle, upload.index, upload.sub);
  const std::size_t count = std::min<std::size_t>(7, upload.bytes.size() - upload.sent);
  can_frame answer{};
  answer.can_id = 0x580 + node_;
  answer.can_dlc = 8;
  for (std::size_t i = 0; i < count; ++i)
    answer.data[1 + i] = static_cast<std::uint8_t>(upload.bytes[upload.sent + i]);
  upload.sent += count;
  const bool is_last = upload.sent == upload.bytes.size();
  answer.data[0] =
      static_cast<std::uint8_t>((upload.toggle ? 0x10U : 0U) | (7 - count) << 1U | (is_last ? 1U : 0U));
  upload.toggle = !upload.toggle;
  if (is_last) upload_.reset();
  return answer;
}

can_frame CanopenSdoServer::download(const can_frame& frame, std::uint16_t index, std::uint8_t sub) {
  upload_.reset();
  const bool expedited = (frame.data[0] & 0x02U) != 0, says_size = (frame.data[0] & 0x01U) != 0;
  if (!expedited) return abort(abort_code::kUnknownCommand, index, sub);
  std::size_t count = says_size ? 4 - (frame.data[0] >> 2U & 0x03U) : 4;
  if (!says_size) {
    // As long as the object is.
    const auto* entry = dictionary_.find(index, sub);
    if (entry != nullptr) count = std::min<std::size_t>(entry->bytes, 4);
  }
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) bytes.push_back(static_cast<char>(frame.data[4 + i]));
  const std::uint32_t code = dictionary_.write(index, sub, bytes);
  if (code != 0) return abort(code, index, sub);
  return fresh(0x60, index, sub);
}

}  // namespace rig::sim::wire
