// What became of a client's connection over the network, which ZeroMQ tells by the way. Private to protocol.
#pragma once

#include "core/base/result.h"
#include "protocol/sockets.h"

namespace rig::protocol {

class HandshakeWatch {
 public:
  /// Before `socket` connects.
  [[nodiscard]] static base::Result<HandshakeWatch> start(const Context& context, const Socket& socket);

  /// To be polled together with the client's socket.
  [[nodiscard]] void* handle() const { return events_.get(); }
  /// Takes in what happened since the last call.
  void read();

  /// The server knows this client's key not.
  [[nodiscard]] bool turned_away() const { return turned_away_; }
  /// A connection was there and ended before the handshake did: another server, or another key of its.
  [[nodiscard]] bool broken_off() const { return broken_off_; }
  /// A connection that was good has ended since the last call of take_lost().
  [[nodiscard]] bool take_lost() { return std::exchange(lost_, false); }

 private:
  explicit HandshakeWatch(Socket events) : events_(std::move(events)) {}

  Socket events_;
  bool good_ = false;
  bool turned_away_ = false;
  bool broken_off_ = false;
  bool lost_ = false;
};

}  // namespace rig::protocol
