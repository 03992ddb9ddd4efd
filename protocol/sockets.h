// ZeroMQ's context and sockets, closed by themselves. Private to protocol.
#pragma once

#include <cerrno>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
#include <zmq.h>

namespace rig::protocol {

class Context {
 public:
  Context() : handle_(zmq_ctx_new()) {}
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ~Context() {
    // A signal may come while it waits for the last socket.
    while (zmq_ctx_term(handle_) != 0 && zmq_errno() == EINTR) {
    }
  }
  [[nodiscard]] void* get() const { return handle_; }

 private:
  void* handle_;
};

class Socket {
 public:
  Socket(const Context& context, int type) : handle_(zmq_socket(context.get(), type)) { set(ZMQ_LINGER, 0); }
  Socket(Socket&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Socket& operator=(Socket&&) = delete;
  ~Socket() {
    if (handle_ != nullptr) zmq_close(handle_);
  }
  [[nodiscard]] void* get() const { return handle_; }

  void set(int option, int value) const { zmq_setsockopt(handle_, option, &value, sizeof value); }
  void set_wide(int option, long long value) const { zmq_setsockopt(handle_, option, &value, sizeof value); }
  /// For options that must not fail quietly: false where ZeroMQ does not take it.
  [[nodiscard]] bool require(int option, int value) const {
    return zmq_setsockopt(handle_, option, &value, sizeof value) == 0;
  }
  [[nodiscard]] bool require(int option, std::string_view value) const {
    return zmq_setsockopt(handle_, option, value.data(), value.size()) == 0;
  }

 private:
  void* handle_;
};

/// What ZeroMQ knows of a message's sender by itself, apart from what the message says. Empty: nothing.
struct Origin {
  std::string user_id;       ///< as the ZAP handler named the one whose handshake it let in
  std::string peer_address;  ///< of a TCP peer; of a local one with the kernel's word on who it is
};

/// A message's frames, copied out; nothing where none is waiting. Never blocks.
[[nodiscard]] std::optional<std::vector<std::string>> receive(const Socket& socket, Origin* origin = nullptr);

/// Sends the frames as one message without blocking; false (with errno) where that cannot be done now or at
/// all.
[[nodiscard]] bool send(const Socket& socket, const std::vector<std::string_view>& frames);

}  // namespace rig::protocol
