// The devices that the module offers: one camera.
#pragma once

#include <vector>

#include "core/base/config.h"
#include "core/base/result.h"
#include "drivers/api/module.h"

namespace rig::drivers::v4l2 {

void check_settings(const base::ConfigTable& settings);
[[nodiscard]] base::Result<std::vector<Device>> open_devices(const OpenContext& context);

}  // namespace rig::drivers::v4l2
