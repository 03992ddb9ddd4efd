// The devices that the module offers to rigd.
#pragma once

#include <vector>

#include "core/base/config.h"
#include "drivers/api/module.h"

namespace rig::drivers::gpiod_lines {

/// Validates [module.settings]; mistakes are noted there.
void check_settings(const base::ConfigTable& settings);

/// "lines" and, where the settings have a light, "light"; both on bus "lines".
[[nodiscard]] base::Result<std::vector<Device>> open_devices(const OpenContext& context);

}  // namespace rig::drivers::gpiod_lines
