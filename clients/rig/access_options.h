// The command line of `rig control` and `rig keys`.
#pragma once

#include <functional>

#include "clients/rig/commands.h"
#include "core/base/command_line.h"

namespace rig::client {

/// Adds a command that talks to rigd, with its options.
using MakeCommand = std::function<CLI::App*(CLI::App& parent, const char* name, const char* help)>;
/// What the command line asked for.
using Chosen = std::function<Result<void>()>;

/// All that is handed in must live until `chosen` has been called.
void offer_control(CLI::App& app, const MakeCommand& command, const Connection& to, Chosen& chosen);
void offer_keys(CLI::App& app, Chosen& chosen);

}  // namespace rig::client
