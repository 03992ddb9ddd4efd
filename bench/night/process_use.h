// What another process takes of the machine, as the kernel tells.
#pragma once

#include <sys/types.h>

namespace rig::bench {

/// Memory that is present now; 0 where the process is gone.
[[nodiscard]] double resident_MiB(pid_t pid);

/// Processor time of all its threads since it began; 0 where the process is gone.
[[nodiscard]] double processor_s(pid_t pid);

}  // namespace rig::bench
