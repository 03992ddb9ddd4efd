// Nominal kinematics of the rig (McAllister 2002, 3.2): what the angles mean before anything is calibrated.
//
// Bench frame: origin where the roll, tilt and pan axes meet; y up, along the pan axis; z from there to the
// camera; x completes a right-handed frame. The light arm turns about y; at arm angle a the light is at
// radius (sin a, 0, cos a). The pan motor (about y) carries the tilt motor (about x), which carries roll
// (about z), which carries the sample plane_offset_m in front of the common point.
#pragma once

#include <optional>
#include <vector>

#include "core/geometry/vec.h"
#include "core/machine/pose.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

[[nodiscard]] geometry::RigidTransform bench_from_sample(const CarrierConfig& carrier,
                                                         const JointAngles& angles);
[[nodiscard]] geometry::Vec3 light_in_bench(const LightConfig& light, const JointAngles& angles);
[[nodiscard]] geometry::Vec3 camera_in_bench(const CameraConfig& camera);

/// Directions from the sample's centre to the light and to the camera, unit vectors in the sample frame.
struct DirectionPair {
  geometry::Vec3 incident;
  geometry::Vec3 exitant;
};
[[nodiscard]] DirectionPair directions_at_centre(const RigConfig& rig, const JointAngles& angles);

/// The image of a rectangle in the sample plane, as sample_outline has it.
[[nodiscard]] std::optional<std::vector<geometry::Vec2>> rectangle_outline(const RigConfig& rig,
                                                                           const JointAngles& angles,
                                                                           geometry::Vec2 centre_m,
                                                                           double width_m, double height_m);

/// The image of the sample's outline, four pixels in the order (-x,-y) (+x,-y) (+x,+y) (-x,+y); nothing where
/// a corner is behind the camera.
[[nodiscard]] std::optional<std::vector<geometry::Vec2>> sample_outline(const RigConfig& rig,
                                                                        const JointAngles& angles);

}  // namespace rig::machine
