// Pictures for a page: from linear values to PNG in a data URL.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::report {

/// Linear RGB of a map, index (t * columns + s) * 3 + c; row 0 is the edge of least y.
struct Picture {
  int columns = 0, rows = 0;
  std::vector<float> rgb;
};

/// An <img> source that shows the picture upright, linear values times `exposure` as sRGB.
[[nodiscard]] base::Result<std::string> data_url(const Picture& picture, double exposure);

/// A scalar map as colours from dark blue (low) to yellow (high).
[[nodiscard]] Picture colour_scale(const std::vector<float>& values, int columns, int rows, double low,
                                   double high);

/// The value below which `share` of the finite values lie.
[[nodiscard]] double percentile(std::vector<float> values, double share);

}  // namespace rig::report
