// Pan-tilt units of Directed Perception and FLIR (PTU-D46, C46, D48, D300, E46) over RS-232: up to two axes
// of one device on one line. The unit is asked for its resolution, its travel and its speeds; it is driven
// terse, without echo, each move begun as it is commanded. Homing is the unit's own reset, which runs into
// the end stops. It has no encoder and no query that tells whether it was without power since its last reset,
// so an axis counts as homed only while this module has seen the reset and heard the unit ever since: after a
// restart, a lost line or a power cycle it has to be homed. docs/drivers/ptu_axis.md tells the rest.
#pragma once

#include <vector>

#include "drivers/api/module.h"

namespace rig::drivers::ptu {

void check_settings(const base::ConfigTable& settings);

/// Opens the line and sets the unit up; both axes are on the bus "ptu".
[[nodiscard]] base::Result<std::vector<Device>> open_devices(const OpenContext& context);

}  // namespace rig::drivers::ptu
