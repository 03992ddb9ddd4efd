// What a cia402_axis module offers: an axis for each table, all on the bus of its interface.
#pragma once

#include "drivers/api/module.h"

namespace rig::drivers::cia402 {

void check_settings(const base::ConfigTable& settings);

/// An interface that is not there, and drives that do not answer, are `lost` when they are called, and come
/// back by themselves.
[[nodiscard]] base::Result<std::vector<Device>> open_devices(const OpenContext& context);

}  // namespace rig::drivers::cia402
