// The least that a server behind ZeroMQ's CURVE can do: a ROUTER that sends a message back for each that
// comes, and to the same client a stream of large ones, as rigd's previews are.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <string>
#include <thread>
#include <zmq.hpp>

#include "bench/base/latencies.h"

namespace rig::bench {

struct EchoSizes {
  std::size_t request_bytes = 0;
  std::size_t reply_bytes = 0;
  std::size_t preview_bytes = 0;
  Steady::duration preview_every{};
};

class EchoServer {
 public:
  explicit EchoServer(const EchoSizes& sizes);
  EchoServer(const EchoServer&) = delete;
  EchoServer& operator=(const EchoServer&) = delete;
  ~EchoServer();

  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  [[nodiscard]] const std::string& public_key() const { return public_key_; }
  /// Whether previews go to the client that asked last.
  void stream(bool on) { streaming_ = on; }

 private:
  void run();
  const EchoSizes sizes_;
  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::router};
  std::string endpoint_;
  std::string public_key_;
  std::atomic<bool> streaming_{false};
  std::atomic<bool> ending_{false};
  std::thread thread_;
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
