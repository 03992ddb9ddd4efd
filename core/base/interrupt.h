// Ctrl-C and SIGTERM as a question that long work asks between its steps.
#pragma once

#include "core/base/result.h"

namespace rig::base {

/// Turns SIGINT and SIGTERM into interrupted(). A second signal ends the program at once, as without this.
void catch_interrupts();

/// Whether somebody asked the program to end. False for ever where catch_interrupts was not called.
[[nodiscard]] bool interrupted();

/// The Error of work that ended early because it was asked to; `left` says what remains usable and how to go
/// on.
[[nodiscard]] tl::unexpected<Error> interrupted_error(std::string left);

}  // namespace rig::base
