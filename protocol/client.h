// A client's side of the protocol.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "protocol/keys.h"
#include "protocol/rig.pb.h"

namespace rig::protocol {

/// Where rigd listens: $RIG_ENDPOINT, else the operate socket in $RIG_RUNTIME_DIR, else in /run/rigd.
[[nodiscard]] std::string default_endpoint();

/// What a client needs to connect over the network.
struct ClientKeys {
  KeyPair own;
  std::string server;  ///< public key of rigd
};

/// The keys that $RIG_KEY (a file of `rig keys make`) and $RIG_SERVER_KEY (rigd's public key, or a file that
/// has it) name.
[[nodiscard]] base::Result<ClientKeys> keys_from_environment();

/// One connection. Used from one thread.
class Client {
 public:
  /// To tcp://... with keys_from_environment(), to anything else without keys.
  [[nodiscard]] static base::Result<Client> connect(const std::string& endpoint);
  [[nodiscard]] static base::Result<Client> connect(const std::string& endpoint, const ClientKeys& keys);
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  /// Sends a request (its id and version are set here) and waits for its answer; events that come meanwhile
  /// are kept for next_event. No answer within `timeout` is ErrorCode::timeout, a key that rigd does not
  /// allow ErrorCode::refused; a refusal or failure of the request is a Reply, not an Error.
  [[nodiscard]] base::Result<Reply> ask(Request request, std::chrono::milliseconds timeout);

  /// The next event, waiting up to `timeout`. ErrorCode::timeout where the connection over the network broke:
  /// a subscription ends with it.
  [[nodiscard]] base::Result<std::optional<Event>> next_event(std::chrono::milliseconds timeout);

 private:
  struct State;
  explicit Client(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace rig::protocol
