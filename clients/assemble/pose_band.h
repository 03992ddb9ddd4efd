// One pose's share of a band of the observation map.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "calibration/hdr_merge.h"
#include "calibration/rectify.h"
#include "calibration/reference.h"
#include "core/base/result.h"
#include "core/geometry/sample_grid.h"
#include "core/geometry/vec.h"
#include "core/machine/rig_config.h"
#include "core/maps/observation_map.h"
#include "core/scan/frame_file.h"
#include "core/scan/journal.h"

namespace rig::assemble {

/// A registered pose.
struct PoseWork {
  const scan::PoseRecord* record = nullptr;
  geometry::RigidTransform camera_from_sample;
  geometry::Vec3 light_m;  ///< sample frame
};

/// A bracket in memory.
struct Bracket {
  std::vector<scan::Frame> frames;
  [[nodiscard]] std::vector<calibration::Exposure> exposures() const;
};

/// Reads all frames of a pose; a damaged one, or one of another size than the camera's, is an error.
[[nodiscard]] base::Result<Bracket> read_bracket(const std::filesystem::path& scan,
                                                 const machine::CameraConfig& camera,
                                                 const scan::PoseRecord& record);

/// Reads every reference patch of a pose; why one cannot be read is added to `troubles`.
[[nodiscard]] std::vector<calibration::PatchReading> read_patches(const Bracket& bracket,
                                                                  const machine::RigConfig& rig,
                                                                  const PoseWork& work,
                                                                  std::vector<std::string>* troubles);

/// Merges what the block's rows need, rectifies it, and stores reflectance times the light's intensity as
/// pose `pose` of the block. Texels the light does not reach are missing.
void fill_pose(const Bracket& bracket, const machine::RigConfig& rig, const PoseWork& work,
               const geometry::SampleGrid& grid, int pose, maps::ObservationBlock* block);

/// Divides what fill_pose stored by each pose's intensity and marks what is below its noise as dark.
void apply_scale(std::span<const calibration::Rgb> intensity, maps::ObservationBlock* block);

}  // namespace rig::assemble
