// The settings of the module: [module.settings] of rig.toml.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/base/config.h"
#include "drivers/common/axis_settings.h"
#include "drivers/common/retry.h"
#include "drivers/modbus_axis/profile.h"
#include "drivers/modbus_axis/wire.h"

namespace rig::drivers::modbus {

struct DriveSettings {
  AxisSettings axis;
  int slave = 1;
  std::shared_ptr<const Profile> profile;
  OptionValues options;
  struct SoftLimits {
    double low_rad, high_rad;
  };
  std::optional<SoftLimits> soft_limits;
};

struct ModuleSettings {
  WireSettings wire;
  RetryPolicy retry;
  std::vector<DriveSettings> drives;
};

/// Errors, those of the profiles too, are noted in the table; a drive whose profile cannot be read is left
/// out.
[[nodiscard]] ModuleSettings read_settings(const base::ConfigTable& settings);

}  // namespace rig::drivers::modbus
