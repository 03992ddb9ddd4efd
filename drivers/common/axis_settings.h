// What every axis driver reads of an axis: [module.settings.axis.NAME] of rig.toml.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/base/config.h"
#include "drivers/common/counts.h"

namespace rig::drivers {

struct AxisSettings {
  std::string name;  ///< of the device: NAME
  CountScale scale;
  double max_velocity_rad_s = 0;
  double max_acceleration_rad_s2 = 0;
};

/// The tables of the module's axes with their names, in the order of the file. None at all is an error,
/// noted.
[[nodiscard]] std::vector<std::pair<std::string, base::ConfigTable>> axis_tables(
    const base::ConfigTable& settings);

/// The keys counts_per_deg, reversed, zero_deg, max_velocity_deg_s and max_acceleration_deg_s2, under the
/// names that `rig axis setup` changes. Errors are noted in the table. With `device_knows_scale`
/// counts_per_deg is not read: the device is asked.
[[nodiscard]] AxisSettings read_axis_settings(const std::string& name, const base::ConfigTable& table,
                                              bool device_knows_scale = false);

}  // namespace rig::drivers
