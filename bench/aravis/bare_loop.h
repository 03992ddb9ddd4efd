// The camera in Aravis' hands alone: what it delivers at most.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "core/base/result.h"

namespace rig::bench {

struct LoopOptions {
  std::string address = "127.0.0.1";
  int width = 2048, height = 2048;  ///< of Mono8
  int packet_size = 60000;
  int socket_buffer_bytes = 4 << 20;
  int frames = 100;
  double exposure_us = 1000;
  bool free_run = false;  ///< else each frame by a software trigger, when the one before was checked
};

struct LoopResult {
  int good = 0;        ///< complete, and the check liked them
  int lost = 0;        ///< incomplete, or none in time
  int wrong = 0;       ///< complete, and the check did not like them
  double seconds = 0;  ///< from the first frame to the last

  [[nodiscard]] double rate() const { return seconds > 0 ? (good + lost + wrong - 1) / seconds : 0; }
};

/// Acquires, checks and does not store. Opens the camera and lets go of it.
[[nodiscard]] base::Result<LoopResult> run_bare_loop(
    const LoopOptions& options, const std::function<bool(std::span<const std::uint8_t>)>& check);

}  // namespace rig::bench
