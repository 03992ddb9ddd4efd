// What this process holds of the machine: for what must not grow.
#pragma once

#include <cstddef>

namespace rig::drivers::conformance {

struct ProcessUse {
  std::size_t descriptors = 0;     ///< in /proc/self/fd
  std::size_t threads = 0;         ///< in /proc/self/task
  std::size_t heap_bytes = 0;      ///< handed out by malloc; 0 under a sanitizer, which has its own
  std::size_t resident_bytes = 0;  ///< of memory
};

[[nodiscard]] ProcessUse process_use();

}  // namespace rig::drivers::conformance
