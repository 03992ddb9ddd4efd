#include "protocol/sockets.h"

namespace rig::protocol {

namespace {

std::string property(zmq_msg_t& part, const char* name) {
  const char* value = zmq_msg_gets(&part, name);
  return value != nullptr ? value : "";
}

}  // namespace

std::optional<std::vector<std::string>> receive(const Socket& socket, Origin* origin) {
  std::vector<std::string> frames;
  int more = 1;
  while (more != 0) {
    zmq_msg_t part;
    zmq_msg_init(&part);
    if (zmq_msg_recv(&part, socket.get(), ZMQ_DONTWAIT) < 0) {
      zmq_msg_close(&part);
      return std::nullopt;
    }
    frames.emplace_back(static_cast<const char*>(zmq_msg_data(&part)), zmq_msg_size(&part));
    more = zmq_msg_more(&part);
    if (origin != nullptr && more == 0) *origin = {property(part, "User-Id"), property(part, "Peer-Address")};
    zmq_msg_close(&part);
  }
  return frames;
}

bool send(const Socket& socket, const std::vector<std::string_view>& frames) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const int flags = ZMQ_DONTWAIT | (i + 1 < frames.size() ? ZMQ_SNDMORE : 0);
    if (zmq_send(socket.get(), frames[i].data(), frames[i].size(), flags) < 0) return false;
  }
  return true;
}

}  // namespace rig::protocol
