// Finds one camera among those that are there, by its id, serial number or address.
#pragma once

#include "core/base/result.h"
#include "drivers/aravis_camera/glib.h"
#include "drivers/aravis_camera/settings.h"

namespace rig::drivers::aravis {

/// Opens it and takes control of it. Takes seconds where it is not there. Errors: lost (not there, or
/// another program has it), bad_input (several have that serial number).
[[nodiscard]] base::Result<Owned<ArvCamera>> find_camera(const Settings& settings);

}  // namespace rig::drivers::aravis
