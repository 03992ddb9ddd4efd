// A client's side of the protocol.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "protocol/rig.pb.h"

namespace rig::protocol {

/// Where rigd listens: $RIG_ENDPOINT, else the operate socket in $RIG_RUNTIME_DIR, else in /run/rigd.
[[nodiscard]] std::string default_endpoint();

/// One connection. Used from one thread.
class Client {
 public:
  [[nodiscard]] static base::Result<Client> connect(const std::string& endpoint);
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  /// Sends a request (its id and version are set here) and waits for its answer; events that come meanwhile
  /// are kept for next_event. No answer within `timeout` is ErrorCode::timeout; a refusal or failure is a
  /// Reply, not an Error.
  [[nodiscard]] base::Result<Reply> ask(Request request, std::chrono::milliseconds timeout);

  /// The next event, waiting up to `timeout`.
  [[nodiscard]] base::Result<std::optional<Event>> next_event(std::chrono::milliseconds timeout);

 private:
  struct State;
  explicit Client(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace rig::protocol
