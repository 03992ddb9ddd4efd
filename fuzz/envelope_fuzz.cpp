// Whatever bytes come over a socket: the readers of both directions say what they are, or why they are
// nothing.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "protocol/envelope.h"

// The first byte says in how many frames the rest came, and whether it begins with the magic.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  std::vector<std::string_view> frames;
  if ((data[0] & 1U) != 0) frames.push_back(rig::protocol::kMagic);
  const std::size_t pieces = data[0] >> 6U;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < pieces; ++i) {
    const std::size_t length = (rest.size() - begin) / 2;
    frames.push_back(rest.substr(begin, length));
    begin += length;
  }
  frames.push_back(rest.substr(begin));

  std::uint64_t id = 0;
  if (const auto request = rig::protocol::read_request(frames, id)) {
    // What was read can be written and is read as the same.
    std::uint64_t again_id = 0;
    const std::string bytes = request->SerializeAsString();
    const auto again = rig::protocol::read_request({rig::protocol::kMagic, bytes}, again_id);
    if (!again || again_id != id || request->id() != id) std::abort();
  } else if (request.error().what.empty()) {
    std::abort();
  }
  if (const auto message = rig::protocol::read_message(frames)) {
    const std::string bytes = message->SerializeAsString();
    if (!rig::protocol::read_message({rig::protocol::kMagic, bytes})) std::abort();
  } else if (message.error().what.empty()) {
    std::abort();
  }
  return 0;
}
