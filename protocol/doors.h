// The sockets of a server, bound: two local ones and the network's. Private to protocol.
#pragma once

#include <filesystem>

#include "core/base/result.h"
#include "protocol/server.h"
#include "protocol/socket_folder.h"
#include "protocol/sockets.h"

namespace rig::protocol {

/// One socket that clients connect to.
struct Door {
  Socket socket;
  bool network = false;
  Role most = Role::observer;  ///< what a local one lets anybody be
  std::filesystem::path file;  ///< of a local one, removed at the end
  std::string endpoint;        ///< of the network's
};

/// A local socket: only the owner and `group` may connect, from the first moment on. Empty: the group of this
/// process.
[[nodiscard]] base::Result<Door> open_local_door(const Context& context, const SocketFolder& folder,
                                                 const char* file, Role most, const std::string& group,
                                                 const ServerOptions& options);

/// The network's socket. The ZAP handler must be bound in `context` before; without one nobody gets in.
[[nodiscard]] base::Result<Door> open_network_door(const Context& context, const ServerOptions& options);

/// Where ZeroMQ asks who may connect.
[[nodiscard]] base::Result<Socket> open_zap_socket(const Context& context);

}  // namespace rig::protocol
