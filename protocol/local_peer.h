// Who is at the other end of a local socket, as the kernel says. Private to protocol.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <sys/types.h>

namespace rig::protocol {

/// The user of the process that connected, out of ZeroMQ's "Peer-Address" of a message from an ipc socket
/// ("HOST:UID:GID:PID", which ZeroMQ has from SO_PEERCRED). Nothing where it is not of that form.
[[nodiscard]] std::optional<uid_t> peer_uid(std::string_view peer_address);

/// Names of local users: "local/anna", or "local/uid-1003" where the system knows no name. Asked once a user,
/// because the system may have to ask the network.
class LocalNames {
 public:
  [[nodiscard]] const std::string& of(uid_t uid);

 private:
  std::map<uid_t, std::string> names_;
};

}  // namespace rig::protocol
