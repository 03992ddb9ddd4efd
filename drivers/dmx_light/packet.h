// What goes into the channels of a packet.
#pragma once

#include <string>

#include "drivers/dmx_light/settings.h"

namespace rig::drivers::dmx_light {

/// A level as the channels hold it: the nearest of 256 or, with a fine channel, of 65536 steps.
[[nodiscard]] double nearest_level(const DmxSettings& settings, double level);

/// All channels: level, shutter and the fixed ones; 0 in the rest.
[[nodiscard]] std::string make_packet(const DmxSettings& settings, double level, bool shutter_open);

}  // namespace rig::drivers::dmx_light
