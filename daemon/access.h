// From rig.toml to the sockets that rigd listens on.
#pragma once

#include "core/base/result.h"
#include "core/machine/rig_config.h"
#include "daemon/rigd.h"
#include "protocol/server.h"

namespace rig::daemon {

[[nodiscard]] protocol::ServerOptions server_options(const Options& options,
                                                     const machine::AccessConfig& access);

/// Whether the files that [network] names are there and right, without listening.
[[nodiscard]] base::Result<void> check_access(const protocol::ServerOptions& options);

}  // namespace rig::daemon
