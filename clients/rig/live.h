// Photographs again and again, measured as they come: for mounting and focusing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/rig/commands.h"

namespace rig::client {

inline constexpr const char* kInstalledRigToml = "/etc/rigd/rig.toml";

struct LiveOptions {
  double exposure_ms = 20;
  bool automatic = false;                  ///< --auto: the exposure follows the level
  bool once = false;                       ///< one set of figures, then end
  std::string save;                        ///< the last frame, .png or .tif; empty: nowhere
  std::string config = kInstalledRigToml;  ///< levels, sample and fiducials; done without if it is absent
  /// Measure on a preview so wide; 0: on the raw frame. Nothing: raw here, a preview over the network.
  std::optional<std::uint32_t> preview_width;
};

/// Shows frames until interrupted, which is an Error with the best focus as its hint; with `once` until one
/// is measured, with `automatic` too until its exposure is good.
[[nodiscard]] Result<void> live(const Connection& to, const LiveOptions& options);

}  // namespace rig::client
