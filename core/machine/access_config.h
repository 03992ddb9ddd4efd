// Who may reach rigd and command the rig: [network], [sockets] and [control] of rig.toml.
#pragma once

#include <optional>
#include <string>

#include "core/base/config.h"

namespace rig::machine {

/// The way in from other machines. Paths as written: relative ones are meant from the folder of rig.toml.
struct NetworkConfig {
  std::string endpoint;    ///< "tcp://ADDRESS:PORT"
  std::string key_file;    ///< rigd's own keys
  std::string allow_list;  ///< of the clients' keys
};

struct AccessConfig {
  std::optional<NetworkConfig> network;  ///< nothing: local sockets only
  std::string observe_group;             ///< of observe.sock; empty: the group that rigd runs in
  std::string operate_group;             ///< of operate.sock; likewise
  double release_after_s = 60;           ///< control of a client that is not heard of; wall time
};

/// Reads the three tables, each of which may be absent; mistakes are noted in the document.
[[nodiscard]] AccessConfig read_access(const base::ConfigTable& root);

}  // namespace rig::machine
