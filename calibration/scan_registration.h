// Registration of a committed pose from its frames on disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "calibration/fiducials/tag_finder.h"
#include "calibration/registration.h"
#include "core/geometry/vec.h"
#include "core/machine/rig_config.h"
#include "core/scan/journal.h"

namespace rig::calibration {

/// Share of the raw samples saturated within the tags (white margin included) where `nominal` puts them, of
/// those inside the image.
[[nodiscard]] double saturated_share_of_tags(const machine::RigConfig& rig,
                                             const geometry::RigidTransform& nominal,
                                             const std::vector<std::uint16_t>& mosaic);

/// Reads the frames of a committed pose, longest exposure first, until one shows the tags unsaturated; finds
/// the tags there and solves. Where that does not register, the other frames are tried and the one with most
/// tags speaks. A damaged frame is a rejection with its reason.
[[nodiscard]] PoseRegistration register_pose(const std::filesystem::path& scan_folder,
                                             const machine::RigConfig& rig, const scan::PoseRecord& pose,
                                             TagFinder& finder, const RegistrationLimits& limits = {});

}  // namespace rig::calibration
