// rigd's side of the protocol: one thread owns the ZeroMQ sockets. Requests come out through a handler,
// answers and events go in from any thread, in one order.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "core/base/result.h"
#include "protocol/rig.pb.h"
#include "protocol/role.h"

namespace rig::protocol {

/// One client's connection, as long as it lasts.
struct ClientId {
  std::uint64_t socket = 0;  ///< which of the server's sockets
  std::string routing;       ///< ZeroMQ's routing id there; chosen by the client, so it proves nothing
  std::string key = {};      ///< public key of its handshake; empty on local sockets
  bool operator<(const ClientId& other) const {
    return std::tie(socket, routing, key) < std::tie(other.socket, other.routing, other.key);
  }
  bool operator==(const ClientId&) const = default;
};

struct Incoming {
  ClientId client;
  Role role = Role::observer;
  Request request;
  /// Whose request it is, as the handshake or the kernel says: the name of a key, or "local/USER".
  std::string who = {};
};

/// The way in from other machines: CURVE, and only for keys that are on the list.
struct NetworkDoor {
  std::string endpoint;              ///< "tcp://ADDRESS:PORT"; port * takes a free one
  std::filesystem::path key_file;    ///< rigd's own keys
  std::filesystem::path allow_list;  ///< read again when it changes
};

struct ServerOptions {
  std::filesystem::path folder;  ///< sockets observe.sock and operate.sock are made here, mode 0660
  std::size_t max_message_bytes = std::size_t{4} << 20;  ///< larger requests end the connection
  std::size_t queue_per_client =
      1000;                   ///< messages; events beyond it are dropped for that client, and counted
  std::string observe_group;  ///< that may connect to observe.sock; empty: the group of this process
  std::string operate_group;  ///< that may connect to operate.sock; likewise
  std::optional<NetworkDoor> network;  ///< nothing: local sockets only
  /// Called on the server's thread with the name of a client whose key was taken off the list.
  std::function<void(std::string)> revoked = nullptr;
};

/// The previews that a client wants.
struct PreviewWish {
  int width = 400;                    ///< pixels
  std::chrono::milliseconds every{};  ///< at most one in so much wall time
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
  /// `previews`: none where it is empty.
  void subscribe(const ClientId& client, std::optional<PreviewWish> previews);
  void unsubscribe(const ClientId& client);
  void publish(const Event& event);
  /// The widths that subscribers of previews want now.
  [[nodiscard]] std::set<int> preview_widths() const;
  /// To the subscribers of previews of this width only, each at its pace; dropped where their way is full.
  void publish_preview(Event event, int width = PreviewWish{}.width);

  [[nodiscard]] std::size_t client_count() const;
  /// Where it listens on the network, with the port it got; empty: nowhere.
  [[nodiscard]] const std::string& network_endpoint() const;
  /// Of all clients since the start.
  [[nodiscard]] std::uint64_t previews_dropped() const;

 private:
  struct State;
  explicit Server(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace rig::protocol
