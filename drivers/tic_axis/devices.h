// The axes that this module offers to rigd.
#pragma once

#include <vector>

#include "core/base/config.h"
#include "drivers/api/module.h"

namespace rig::drivers::tic {

/// Validates [module.settings]; mistakes are noted there.
void check_settings(const base::ConfigTable& settings);

/// An axis for each [module.settings.axis.NAME], each on a bus of its own: a Tic that does not answer holds
/// up no other. A Tic that is not there yet is looked for at every call.
[[nodiscard]] base::Result<std::vector<Device>> open_devices(const OpenContext& context);

}  // namespace rig::drivers::tic
