// The device that the module offers to rigd.
#pragma once

#include <vector>

#include "core/base/config.h"
#include "drivers/api/module.h"

namespace rig::drivers::dmx_light {

/// Validates [module.settings]; mistakes are noted there.
void check_settings(const base::ConfigTable& settings);

/// "light", on bus "light".
[[nodiscard]] base::Result<std::vector<Device>> open_devices(const OpenContext& context);

}  // namespace rig::drivers::dmx_light
