#include "protocol/envelope.h"

namespace rig::protocol {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

Result<void> check_frames(const std::vector<std::string_view>& frames) {
  if (frames.size() != 2) {
    return fail(ErrorCode::bad_input, fmt::format("a message has 2 frames, this one {}", frames.size()));
  }
  if (frames[0] != kMagic) return fail(ErrorCode::bad_input, "the first frame is not 'RIG1'");
  return {};
}

Result<void> check_version(std::uint32_t version) {
  if (version == 0) return fail(ErrorCode::bad_input, "the message names no protocol version");
  if (version > kVersion) {
    return fail(ErrorCode::newer,
                fmt::format("protocol version {} is newer than {}, which is spoken here", version, kVersion));
  }
  return {};
}

}  // namespace

Result<Request> read_request(const std::vector<std::string_view>& frames, std::uint64_t& id) {
  if (auto ok = check_frames(frames); !ok) return base::pass(ok);
  Request request;
  if (!request.ParseFromArray(frames[1].data(), static_cast<int>(frames[1].size()))) {
    return fail(ErrorCode::bad_input, "the second frame is no Request");
  }
  id = request.id();
  if (auto ok = check_version(request.version()); !ok) return base::pass(ok);
  if (request.command_case() == Request::COMMAND_NOT_SET) {
    return fail(ErrorCode::bad_input, "the request has no command that is known here");
  }
  return request;
}

Result<Message> read_message(const std::vector<std::string_view>& frames) {
  if (auto ok = check_frames(frames); !ok) return base::pass(ok);
  Message message;
  if (!message.ParseFromArray(frames[1].data(), static_cast<int>(frames[1].size()))) {
    return fail(ErrorCode::bad_input, "the second frame is no Message");
  }
  if (auto ok = check_version(message.version()); !ok) return base::pass(ok);
  return message;
}

}  // namespace rig::protocol
