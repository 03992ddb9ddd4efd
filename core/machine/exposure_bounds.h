// The most that the bracket of one pose takes, as its strategy allows: what a job is planned with.
#pragma once

#include "core/machine/job_config.h"
#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

/// Most frames that one pose may take.
[[nodiscard]] int most_frames(const ExposureConfig& exposure);

/// Seconds of exposure of the longest bracket of a pose, without the readouts. Of a predicted bracket, which
/// depends on the pose, exactly its seconds.
[[nodiscard]] double longest_bracket_s(const RigConfig& rig, const ExposureConfig& exposure,
                                       const JointAngles& pose);

}  // namespace rig::machine
