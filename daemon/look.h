// What a frame of a visit shows: means of reference patches, tags, what moved. For the storage thread.
#pragma once

#include <filesystem>
#include <span>

#include "core/base/result.h"
#include "core/machine/rig_config.h"
#include "daemon/action.h"

namespace rig::daemon {

/// Stores the frame of a reference visit in the scan and takes its means; finds the tags in any other.
[[nodiscard]] base::Result<LookFinding> judge(const machine::RigConfig& rig,
                                              const std::filesystem::path& scan, const JudgeLook& look,
                                              std::span<const std::uint16_t> pixels);

}  // namespace rig::daemon
