// A scan copied to another place while it grows: only committed poses, each frame proven by its hash.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scan/journal.h"

namespace rig::scan {

struct PushReport {
  ScanProgress progress;  ///< of the scan, when its journal was read
  std::size_t frames_copied = 0;
  std::size_t frames_there = 0;  ///< that an earlier push had brought
  std::uint64_t bytes_copied = 0;
  std::vector<std::string> problems;  ///< frames that are damaged or missing in the scan itself
  /// Nothing is pending, and all of it is there.
  [[nodiscard]] bool complete() const {
    return problems.empty() && progress.done + progress.abandoned == progress.total;
  }
};

/// Brings `to` to what the journal of `scan` says now: rig.toml and job.toml, the frames of every committed
/// pose, then a copy of the journal, which so names no frame that is not there, but for `problems`. Each
/// frame is written beside its place, flushed, read back, compared with the journal's hash and renamed. What
/// an earlier push brought is left alone; a push that was cut off is finished by the next. `to` must not
/// exist, be empty, or hold an earlier push of the same scan. The scan is only read; rigd may be working on
/// it. `on_frame` is called after each frame with the number still to do; it may be empty.
[[nodiscard]] base::Result<PushReport> push_scan(const std::filesystem::path& scan,
                                                 const std::filesystem::path& to,
                                                 const std::function<void(std::size_t)>& on_frame);

/// Pushes again and again until nothing is pending. `wait` is called where nothing new was there; false ends
/// it early. The sum of all pushes.
[[nodiscard]] base::Result<PushReport> follow_scan(const std::filesystem::path& scan,
                                                   const std::filesystem::path& to,
                                                   const std::function<void(std::size_t)>& on_frame,
                                                   const std::function<bool(const PushReport&)>& wait);

}  // namespace rig::scan
