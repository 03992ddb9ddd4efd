// What is done to a simulated USB video camera in words, a line each, for rig-sim-uvc.
#pragma once

#include <string>
#include <string_view>

#include "core/base/result.h"
#include "sim/wire/uvc_camera.h"

namespace rig::sim::wire {

/// Does what a line says: "light 128", "delay 3", "damage 1", "drop 2", "cut 1 50" (of one frame half),
/// "stall 1 2" (one request, wrong state), "ignore 1", "slow 300" (ms), each as in uvc_camera.h. "state" is
/// answered with a line that says how the camera stands, any other with an empty text.
[[nodiscard]] base::Result<std::string> carry_out_order(UvcCamera& camera, std::string_view line);

}  // namespace rig::sim::wire
