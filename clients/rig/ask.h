// One request and its answer, on a connection of its own.
#pragma once

#include "clients/rig/commands.h"
#include "protocol/rig.pb.h"

namespace rig::client {

/// A move or homing is answered when it has ended.
inline constexpr double kLongestMotion_s = 600;

/// An Error where it was refused or failed, with rigd's reason, or not answered in time.
[[nodiscard]] Result<protocol::Reply> ask(const Connection& to, const protocol::Request& request,
                                          double timeout_s);

}  // namespace rig::client
