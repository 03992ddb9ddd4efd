// From a stack of photographs to an observation map.
#pragma once

#include <filesystem>
#include <string>

#include "clients/import/photograph.h"
#include "clients/import/stack.h"
#include "core/base/result.h"

namespace rig::import {

struct ImportOptions {
  std::filesystem::path out;
  std::string name;  ///< of the sample
  int columns = 0;   ///< texels along x; 0: a texel a pixel
  Encoding encoding;
  double photograph_noise = 0.01;  ///< relative standard deviation of a value beyond its rounding
  std::size_t memory_mib = 1024;
  std::string command;  ///< as typed, for provenance
};

struct ImportSummary {
  std::size_t photographs = 0;
  int columns = 0, rows = 0;
  double saturated_share = 0, dark_share = 0;  ///< of all values
  [[nodiscard]] std::string text() const;
};

/// Turns decoded values into reflectance, f = L / E with E = power cos(theta_i) / r^2 for a light that is a
/// point and E = power cos(theta_i) for one that is a direction, at every texel, up to one factor for the
/// whole stack; what the light does not reach is missing. All photographs must have one size. Nothing appears
/// under `out` before the map is complete.
[[nodiscard]] base::Result<ImportSummary> import_stack(const Stack& stack, const ImportOptions& options);

}  // namespace rig::import
