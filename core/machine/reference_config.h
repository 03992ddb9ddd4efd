// [reference] of rig.toml: the visits by which a rig that nobody watches proves its light and its room.
#pragma once

#include <optional>

#include "core/base/config.h"
#include "core/machine/pose.h"

namespace rig::machine {

/// [reference.flat]: a frame of a target that is equally bright everywhere. It shows what the patches, few
/// and small, do not: light that falls unevenly, dust, what the optics lose.
struct FlatConfig {
  JointAngles pose_rad{};  ///< where the target is seen lit
  double exposure_s = 0;
  /// The target as a rectangle in the carrier's plane; none: it fills the image.
  struct Target {
    double x_m = 0, y_m = 0;  ///< of its centre
    double width_m = 0, height_m = 0;
  };
  std::optional<Target> target;
  double band = 0.02;      ///< farthest that its mean may be from the first visit's, relative
  double evenness = 0.02;  ///< farthest that one part of it may depart from what all of them did, relative
};

/// A visit takes a dark frame, one of the carrier's reference patches and, where asked for, a flat, each at
/// the same pose every time, and is compared with the scan's first. What fails it suspends the job, and the
/// poses since the last good visit are taken again.
struct ReferenceConfig {
  JointAngles pose_rad{};  ///< patches lit, and seen away from their highlight
  double exposure_s = 0;   ///< of the patches
  double dark_exposure_s = 0;
  int every_poses = 0;     ///< a visit after so many committed poses; 0: not by their number
  double every_s = 0;      ///< or after so much rig time; 0: not by time
  double band = 0.02;      ///< farthest that the patches' mean may be from the first visit's, relative
  double evenness = 0.02;  ///< farthest that one patch may depart from what all of them did, relative
  double dark_dn = 4;      ///< farthest that the dark frame's mean may be above the first visit's
  double shift_px = 3;     ///< after an interruption: farthest that the fiducials may have moved in the image
  double turn_rad = 0.005;  ///< and turned
  int attempts = 3;         ///< bad visits one after the other, before a person is waited for
  double again_s = 600;     ///< from a bad visit to the next
  std::optional<FlatConfig> flat;
};

/// Reads the table [reference]; none: nothing. Mistakes are noted in it.
[[nodiscard]] std::optional<ReferenceConfig> read_reference(const base::ConfigTable& root);

}  // namespace rig::machine
