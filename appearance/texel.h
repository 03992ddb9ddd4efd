// The observations of one texel with their directions, from a block of an observation map.
#pragma once

#include <vector>

#include "appearance/fit.h"
#include "core/geometry/sample_grid.h"
#include "core/maps/observation_map.h"

namespace rig::appearance {

[[nodiscard]] geometry::SampleGrid grid_of(const maps::ObservationHeader& header);

/// Unit vectors from a point of the sample to the light and to the camera of a pose.
struct Directions {
  geometry::Vec3 incident, exitant;
};
[[nodiscard]] Directions directions_at(const maps::PoseGeometry& pose, geometry::Vec3 point_m);

/// Samples of texel (t, s) of the block (counted from its first), for the poses where `use` is true: those
/// that are good, dark or saturated (lower bounds), with light and camera above the horizon.
[[nodiscard]] std::vector<Sample> samples_of(const maps::ObservationHeader& header,
                                             const maps::ObservationBlock& block, int t, int s,
                                             const std::vector<bool>& use);

}  // namespace rig::appearance
