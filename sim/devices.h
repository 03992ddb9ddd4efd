// The devices that the virtual rig offers to rigd.
#pragma once

#include <vector>

#include "core/base/config.h"
#include "drivers/api/module.h"

namespace rig::sim {

/// Validates [module.settings]; mistakes are noted there.
void check_settings(const base::ConfigTable& settings);

/// Axes "roll", "tilt", "pan", "arm" on bus "axes"; "camera" on its own; "light" and "lines" on bus "light".
[[nodiscard]] base::Result<std::vector<drivers::Device>> open_devices(const drivers::OpenContext& context);

}  // namespace rig::sim
