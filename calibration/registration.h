// Registration: where the carrier stood before the camera in each pose of a scan, solved freely from its
// fiducials (McAllister 2002, 3.6, replaces the motors' angles by a homography per image; here it is a rigid
// pose, so that the directions to camera and light follow from it too).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "calibration/carrier_pose.h"
#include "calibration/fiducials/tag_finder.h"
#include "core/geometry/vec.h"
#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::calibration {

/// When a pose is not trusted.
struct RegistrationLimits {
  std::size_t least_tags = 4;
  /// Spread of the tags in use in their narrowest direction, as a share of that of all tags of the carrier.
  double least_spread = 0.35;
  double most_rms_px = 0.5;
  double most_expected_error_m = 0.25e-3;  ///< expected_registration_error_m over the sample
  double most_turn_rad = 0.0873;           ///< away from the nominal pose: 5 degrees
  double most_shift_m = 0.015;             ///< of the sample's centre, likewise
};

/// What became of one pose.
struct PoseRegistration {
  std::int64_t row = 0;  ///< of the scan's plan
  bool registered = false;
  std::string reason;     ///< why not; empty where registered
  int frame = -1;         ///< index within the bracket of the frame the fiducials were taken from
  std::vector<int> tags;  ///< ids in use, ascending
  std::vector<int>
      left_out;  ///< ids seen and not used: contradicting the rest, seen twice, or not on the carrier
  geometry::RigidTransform camera_from_sample;  ///< meaningless where not registered, as is all below
  PoseCovariance covariance{};
  double rms_px = 0;
  double expected_error_m = 0;  ///< expected_registration_error_m over the sample
  double turn_rad = 0;          ///< angle between the registered and the nominal orientation
  double shift_m = 0;           ///< distance between the registered and the nominal centre of the sample
};

/// By nominal kinematics.
[[nodiscard]] geometry::RigidTransform nominal_camera_from_sample(const machine::RigConfig& rig,
                                                                  const machine::JointAngles& angles);

/// Corners of the carrier's tag in the sample frame, in the order of TagSighting; with a margin around the
/// black square.
[[nodiscard]] std::array<geometry::Vec3, 4> tag_corners(const machine::Fiducial& fiducial,
                                                        double margin_m = 0);

/// The pose from tags seen in one image; `row` and `frame` are left to the caller.
[[nodiscard]] PoseRegistration register_tags(const machine::RigConfig& rig,
                                             const geometry::RigidTransform& nominal,
                                             const std::vector<TagSighting>& sightings,
                                             const RegistrationLimits& limits = {});

}  // namespace rig::calibration
