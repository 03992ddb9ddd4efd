// Fits a model to every texel of an observation map.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/result.h"

namespace rig::fit {

struct Options {
  std::filesystem::path observation;
  std::filesystem::path out;
  std::string model = "lafortune";  ///< or "diffuse"
  int leave_out = 0;                ///< every so manieth pose is held out of the fit, from 2 on; 0: none
};

/// Tile row by tile row, on all cores, into an OpenEXR parameter map that appears when it is complete. The
/// same observations are the same bytes. Options that cannot lead to a map are refused before any work.
[[nodiscard]] base::Result<void> fit_map(const Options& options);

}  // namespace rig::fit
