// From a registered scan to an observation map.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::assemble {

struct AssembleOptions {
  std::filesystem::path scan;
  std::filesystem::path out;
  int columns = 512;              ///< texels along x; as many along y as make them nearly square
  std::size_t memory_mib = 1024;  ///< for the block under work and the poses in flight
  std::string command;            ///< as typed, for the map's provenance
};

/// A pose and what a person should know of it.
struct PoseNote {
  std::int64_t row = 0;
  std::string text;
};

struct AssembleSummary {
  std::size_t poses = 0;  ///< in the map
  int columns = 0, rows = 0;
  int bands = 0;                     ///< passes over the frames that the memory bound asked for
  bool absolute = false;             ///< false where no pose shows a reference patch
  double light_between_poses = 0;    ///< relative standard deviation of the light, largest of the colours
  double light_between_patches = 0;  ///< likewise among the patches of a pose
  std::vector<PoseNote> left_out;    ///< poses that are not in the map, with the reason
  std::vector<PoseNote> notes;       ///< patches not used, poses whose patches disagree, damaged frames

  /// For a person, a line each.
  [[nodiscard]] std::string text() const;
};

/// Merges each registered pose's bracket, rectifies it, turns radiance into reflectance with the light's
/// direction and distance at each texel and the scale from the reference patches, and writes the map at
/// `out`. The map is made in bands of whole tile rows so that it never needs more than the memory given;
/// each band reads the frames once. Nothing appears under the name `out` before the map is complete.
[[nodiscard]] base::Result<AssembleSummary> assemble_scan(const AssembleOptions& options);

}  // namespace rig::assemble
