// The clock of the changes of lines.
#pragma once

#include <chrono>
#include <cstdint>

namespace rig::drivers::gpiod_lines {

/// CLOCK_MONOTONIC, by which the kernel stamps changes since Linux 5.7.
[[nodiscard]] inline std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace rig::drivers::gpiod_lines
