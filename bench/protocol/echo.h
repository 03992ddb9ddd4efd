// The least that a server behind ZeroMQ's CURVE can do: a ROUTER that sends a message back for each that
// comes, and to the same client a stream of large ones, as rigd's previews are.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <string>
#include <sys/types.h>
#include <utility>
#include <zmq.hpp>

#include "bench/base/latencies.h"
#include "core/base/result.h"

namespace rig::bench {

struct EchoSizes {
  std::size_t request_bytes = 0;
  std::size_t reply_bytes = 0;
  std::size_t preview_bytes = 0;
  Steady::duration preview_every{};
};

/// A process of its own, as rigd is.
class EchoServer {
 public:
  /// Forks, so there must be no other thread yet.
  [[nodiscard]] static base::Result<EchoServer> start();
  EchoServer(EchoServer&& other) noexcept
      : pid_(std::exchange(other.pid_, -1)),
        orders_(std::exchange(other.orders_, -1)),
        address_(other.address_) {}
  EchoServer& operator=(EchoServer&&) = delete;
  ~EchoServer();

  [[nodiscard]] std::string endpoint() const { return address_.endpoint.data(); }
  [[nodiscard]] std::string public_key() const { return address_.public_key.data(); }
  /// From now on its messages have these sizes; whether previews go to the client that asked last.
  void order(const EchoSizes& sizes, bool streaming) const;

 private:
  friend class EchoProcess;
  struct Address {
    std::array<char, 128> endpoint{};
    std::array<char, 64> public_key{};
  };
  EchoServer(pid_t pid, int orders) : pid_(pid), orders_(orders) {}
  pid_t pid_;
  int orders_;  // the process ends with it
  Address address_;
};

class EchoClient {
 public:
  EchoClient(const EchoServer& server, const EchoSizes& sizes);
  /// Whether the answer came; previews on the way to it are taken and counted.
  [[nodiscard]] bool ask();
  bool pass_until(Steady::time_point time);
  [[nodiscard]] std::size_t previews() const { return previews_; }

 private:
  /// One message, if there is any before `until`: the size of its body, else 0.
  [[nodiscard]] std::size_t take(Steady::time_point until);
  const EchoSizes sizes_;
  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::dealer};
  std::size_t previews_ = 0;
};

}  // namespace rig::bench
