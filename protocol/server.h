// rigd's side of the protocol: one thread owns the ZeroMQ sockets. Requests come out through a handler,
// answers and events go in from any thread, in one order.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/base/result.h"
#include "protocol/rig.pb.h"

namespace rig::protocol {

/// What a connection may do: `observer` may look and stop, `operator_` may command.
enum class Role { observer, operator_ };

/// One client's connection, as long as it lasts.
struct ClientId {
  std::uint64_t socket = 0;  ///< which of the server's sockets
  std::string routing;       ///< ZeroMQ's routing id there
  bool operator<(const ClientId& other) const {
    return socket != other.socket ? socket < other.socket : routing < other.routing;
  }
  bool operator==(const ClientId&) const = default;
};

struct Incoming {
  ClientId client;
  Role role = Role::observer;
  Request request;
};

struct ServerOptions {
  std::filesystem::path folder;  ///< sockets observe.sock and operate.sock are made here, mode 0660
  std::size_t max_message_bytes = std::size_t{4} << 20;  ///< larger requests end the connection
  std::size_t queue_per_client =
      1000;  ///< messages; events beyond it are dropped for that client, and counted
};

class Server {
 public:
  /// Called on the server's thread with every well-formed request; it must only hand over. A malformed
  /// request is answered by the server itself (refused, with the reason) and never reaches it.
  using Handler = std::function<void(Incoming)>;

  [[nodiscard]] static base::Result<std::unique_ptr<Server>> start(const ServerOptions& options,
                                                                   Handler handler);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Safe from every thread. What one thread hands in goes out in that order; a subscription takes effect
  // between what was handed in before and after it.
  void reply(const ClientId& client, const Reply& reply);
  void subscribe(const ClientId& client, bool previews);
  void unsubscribe(const ClientId& client);
  void publish(const Event& event);
  /// To the subscribers of previews only; dropped where their way is full.
  void publish_preview(const Event& event);

  [[nodiscard]] std::size_t client_count() const;
  /// Of all clients since the start.
  [[nodiscard]] std::uint64_t previews_dropped() const;

 private:
  struct State;
  explicit Server(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace rig::protocol
