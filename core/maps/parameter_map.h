// The parameter map: a reflectance model's parameters for every texel. OpenEXR, a named channel per
// parameter, model and units in the header (docs/file-formats.md).
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace rig::maps {

struct Channel {
  std::string name;           ///< "rho_d.R", "lobe1.Cx", "lobe1.n", "residual"
  std::vector<float> values;  ///< rows * columns, index t * columns + s; row 0 is the edge of least y
};

/// In the file scan line 0 is the edge of greatest y, so that viewers show the sample upright.
struct ParameterMap {
  int columns = 0, rows = 0;
  double width_m = 0, height_m = 0;
  std::string model;                              ///< "lafortune", "diffuse", ...
  std::map<std::string, std::string> attributes;  ///< units and provenance: "units.rho_d" = "1"
  std::vector<Channel> channels;

  [[nodiscard]] const Channel* find(const std::string& name) const;
  /// A new channel of zeros. The reference holds until the next one is added.
  Channel& add(std::string name);
};

/// Replaces `path`, whole or not at all. The same map is the same bytes, in whatever order its channels
/// stand.
[[nodiscard]] base::Result<void> write_parameter_map(const std::filesystem::path& path,
                                                     const ParameterMap& map);
/// Refuses files that are no parameter map, damaged ones and newer versions, each with its reason. Channels
/// come back in the order of their names.
[[nodiscard]] base::Result<ParameterMap> read_parameter_map(const std::filesystem::path& path);

}  // namespace rig::maps
