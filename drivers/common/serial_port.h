// What every serial line needs when it is opened, by whomever.
#pragma once

#include <string>

#include "core/base/result.h"

namespace rig::drivers {

/// Takes the open line for this process alone; `busy` where another program has it. Ends with the descriptor.
[[nodiscard]] base::Result<void> take_for_this_process(int fd, const std::string& path);

/// Whether a line can be asked for that speed at all.
[[nodiscard]] bool is_serial_speed(int baud);

/// That the line runs at the speed that it was set to: who sets it is told nothing where the line cannot do
/// it.
[[nodiscard]] base::Result<void> check_speed(int fd, int baud, const std::string& path);

}  // namespace rig::drivers
