// The command line of `rig live` and `rig axis`.
#pragma once

#include "clients/rig/access_options.h"

namespace rig::client {

/// All that is handed in must live until `chosen` has been called.
void offer_live(CLI::App& app, const MakeCommand& command, const Connection& to, Chosen& chosen);
void offer_axis(CLI::App& app, const MakeCommand& command, const Connection& to, Chosen& chosen);

}  // namespace rig::client
