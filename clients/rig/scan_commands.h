// Commands on scans on disk that need no rigd. Each prints what a person wants to know.
#pragma once

#include <string>

#include "core/base/result.h"

namespace rig::client {

using base::Result;

/// Rebuilds a lost or damaged journal; a line a row.
[[nodiscard]] Result<void> scan_recover(const std::string& scan, bool even_if_whole);
/// Copies committed poses, until the job is complete where `follow` is set. An Error where a frame is
/// damaged.
[[nodiscard]] Result<void> scan_push(const std::string& scan, const std::string& to, bool follow);

}  // namespace rig::client
