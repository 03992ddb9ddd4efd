// The frames of a reference visit.
#pragma once

#include <string>
#include <vector>

#include "core/machine/rig_config.h"

namespace rig::machine {

/// One frame of a visit.
struct Look {
  std::string name;
  JointAngles pose_rad;
  double exposure_s;
  bool lit;
};

/// Of each reference visit, in their order. Empty where rig.toml has no [reference]. `has_shutter`: the
/// light.
[[nodiscard]] std::vector<Look> reference_looks(const RigConfig& rig, bool has_shutter);

/// The frame in which the fiducials of a job's sample are looked for. Where rig.toml has [reference].
[[nodiscard]] Look identity_look(const RigConfig& rig);

/// Why the rig cannot go from `from` to the looks, one after the other, and on to `next` (null: it stays
/// there); empty: it can.
[[nodiscard]] std::string why_unreachable(const RigConfig& rig, JointAngles from,
                                          const std::vector<Look>& looks, const JointAngles* next);

}  // namespace rig::machine
