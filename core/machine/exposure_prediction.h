// Exposures predicted from where the highlight is (McAllister 2002, 3.4.1).
#pragma once

#include <vector>

#include "core/machine/job_config.h"
#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

/// Angle between the direction to the camera and the mirror direction of the light, at the sample's centre,
/// nominal geometry; radians, 0 in the highlight.
[[nodiscard]] double mirror_angle_rad(const RigConfig& rig, const JointAngles& angles);

/// The bracket for a pose with that angle, longest exposure first: each exposure between its counterparts in
/// the brackets of the lightest and of the darkest pose, its logarithm linear in the angle; beyond the angles
/// of those two poses, their brackets.
[[nodiscard]] std::vector<double> predicted_bracket_s(const ExposureConfig& config, double mirror_rad);

}  // namespace rig::machine
