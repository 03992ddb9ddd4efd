// Is a scan complete and undamaged?
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scan/frame_file.h"
#include "core/scan/journal.h"

namespace rig::scan {

/// The frame that a record of the journal names, if its bytes are those that were taken. A missing, changed
/// or foreign file is an error that names it and says what to do.
[[nodiscard]] base::Result<Frame> read_recorded_frame(const std::filesystem::path& scan, std::int64_t row,
                                                      const FrameRecord& record);

struct VerifyReport {
  ScanProgress progress;
  std::size_t frames_checked = 0;
  std::uint64_t bytes_checked = 0;
  std::vector<std::string> problems;  ///< each with its file and what to do; empty: undamaged
  [[nodiscard]] bool undamaged() const { return problems.empty(); }
  [[nodiscard]] bool complete() const { return undamaged() && progress.done == progress.total; }
};

/// Hashes every frame the journal names, decodes its header and compares both with the journal; looks for
/// frames missing or unknown. `on_frame` is called after each frame with the number still to do.
[[nodiscard]] base::Result<VerifyReport> verify_scan(const std::filesystem::path& scan,
                                                     const std::function<void(std::size_t)>& on_frame);

}  // namespace rig::scan
