// What the virtual rig knows, in the documented file formats, for the report and the tests alone.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/result.h"

namespace rig::sim {

struct TruthOptions {
  std::string rig;             ///< rig.toml, for its [module.settings]
  std::filesystem::path like;  ///< observation map whose poses and grid are taken
  std::filesystem::path out;   ///< observation map to write
  int every = 4;               ///< texel (s, t) of it is texel (s * every, t * every) of `like`
};

/// Writes the true BRDF of every so manieth texel, area averaged, for the true geometry of each pose and a
/// point light at the aperture's centre; and beside it `<out stem>.regions.exr` at full resolution: region,
/// alpha, albedo.
[[nodiscard]] base::Result<void> write_truth(const TruthOptions& options);

}  // namespace rig::sim
