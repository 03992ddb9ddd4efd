// The one place that says whether a motion is allowed.
#pragma once

#include <array>
#include <string>

#include "core/base/result.h"
#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

/// Whether one axis may stand at an angle. The Error names the axis, the angle and the limit.
[[nodiscard]] base::Result<void> check_axis_limit(const RigConfig& rig, AxisId axis, double angle_rad);

/// Whether the rig may stand so: every axis within its limits and no keep-out rule broken.
[[nodiscard]] base::Result<void> check_standing(const RigConfig& rig, const JointAngles& angles);

/// Whether the rig may move from one pose to another with the axes moving together. Because the axes'
/// progress depends on load, every combination of angles between `from`, the detours (motion.h) and `to` is
/// covered: that box of angles is halved until in each part the bodies are farther apart than they can travel
/// in it. Ways that pass a clearance by less than 0.1 mm may be refused. `to` must be allowed to stand at;
/// `from` need not be within the limits, so that an axis found outside can be driven back in.
[[nodiscard]] base::Result<void> check_move(const RigConfig& rig, const JointAngles& from,
                                            const JointAngles& to);

}  // namespace rig::machine
