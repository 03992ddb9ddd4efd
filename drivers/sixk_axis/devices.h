// Parker Compumotor controllers of the 6000 and 6K series over a serial line, in their ASCII language: up to
// eight axes of one controller on one line. All commands are immediate; each move says its mode,
// acceleration, speed and target before GO. Homing is the controller's own search (HOM); that an axis is
// homed says its status (TAS bit 5), which outlives rigd and not the controller's power, unless the motor has
// stalled or was without current since. docs/drivers/sixk_axis.md tells the rest.
#pragma once

#include <vector>

#include "drivers/api/module.h"

namespace rig::drivers::sixk {

void check_settings(const base::ConfigTable& settings);

/// Opens the line and sets the controller up; all axes are on the bus "controller".
[[nodiscard]] base::Result<std::vector<Device>> open_devices(const OpenContext& context);

}  // namespace rig::drivers::sixk
