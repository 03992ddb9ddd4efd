// Where the fiducials stood in the pose that was committed last, whether they stand there still, and which
// tags a frame shows at all: the work on images behind daemon/visit.h, for the storage thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "calibration/fiducials/compare.h"
#include "core/base/result.h"
#include "core/machine/rig_config.h"
#include "core/scan/journal.h"

namespace rig::daemon {

struct PlaceReference {
  std::int64_t row = 0;
  machine::JointAngles target_rad{};
  double exposure_s = 0;  ///< of the frame of that bracket that showed the most fiducials
  std::vector<calibration::TagSighting> tags;
};

/// From the pose that was committed last. Null: nothing is committed yet. An Error, in words for a person,
/// where its frames do not show enough fiducials to judge by.
[[nodiscard]] base::Result<std::shared_ptr<const PlaceReference>> find_place(
    const std::filesystem::path& scan, const scan::Journal& journal, const machine::RigConfig& rig);

/// All tags of the carrier's family in a frame, in the order of their ids.
[[nodiscard]] base::Result<std::vector<calibration::TagSighting>> tags_in_frame(
    const machine::RigConfig& rig, std::span<const std::uint16_t> pixels);

/// What moved by more than rig.toml tolerates, in words; empty: nothing did.
[[nodiscard]] std::string what_moved_since(const PlaceReference& place,
                                           const std::vector<calibration::TagSighting>& now,
                                           const machine::RigConfig& rig);

}  // namespace rig::daemon
