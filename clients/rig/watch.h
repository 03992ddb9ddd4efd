// Following a job live, through restarts of rigd.
#pragma once

#include <string>

#include "core/base/result.h"

namespace rig::client {

struct WatchOptions {
  std::string endpoint;
  bool until_idle = false;        ///< end when no job is queued or active
  bool lines = false;             ///< lines instead of a whole screen, also on a terminal
  unsigned preview_width = 0;     ///< of the picture that rigd sends, pixels; 0: rigd's choice
  unsigned preview_every_ms = 0;  ///< at most one picture in so much time: for a slow way to rigd
};

/// Shows progress (watch_screen.h) until interrupted, or until idle. An Error where a job failed or was
/// aborted meanwhile.
[[nodiscard]] base::Result<void> watch(const WatchOptions& options);

}  // namespace rig::client
