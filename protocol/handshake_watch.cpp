#include "protocol/handshake_watch.h"

#include <cstdint>
#include <cstring>

namespace rig::protocol {

using base::Result;

namespace {

constexpr const char* kWatchAt = "inproc://handshake-watch";
constexpr int kWanted = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                        ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                        ZMQ_EVENT_DISCONNECTED;

}  // namespace

Result<HandshakeWatch> HandshakeWatch::start(const Context& context, const Socket& socket) {
  Socket events(context, ZMQ_PAIR);
  if (zmq_socket_monitor(socket.get(), kWatchAt, kWanted) != 0 || zmq_connect(events.get(), kWatchAt) != 0) {
    return base::fail(base::ErrorCode::io,
                      fmt::format("cannot watch a connection: {}", zmq_strerror(zmq_errno())));
  }
  return HandshakeWatch(std::move(events));
}

void HandshakeWatch::read() {
  // An event begins with its number in 16 bits; an address follows.
  while (const auto frames = receive(events_)) {
    std::uint16_t event = 0;
    if (frames->empty() || (*frames)[0].size() < sizeof event) continue;
    std::memcpy(&event, (*frames)[0].data(), sizeof event);
    switch (event) {
      case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
        good_ = true;
        broken_off_ = false;
        break;
      case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH:
        turned_away_ = true;
        break;
      case ZMQ_EVENT_DISCONNECTED:
        lost_ = lost_ || good_;
        good_ = false;
        break;
      default:
        broken_off_ = true;
        break;
    }
  }
}

}  // namespace rig::protocol
