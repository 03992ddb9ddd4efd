#include "appearance/texel.h"

#include <cmath>

namespace rig::appearance {

using geometry::Vec3;

geometry::SampleGrid grid_of(const maps::ObservationHeader& h) {
  return {h.columns, h.rows, h.width_m, h.height_m};
}

Directions directions_at(const maps::PoseGeometry& pose, Vec3 point) {
  const Vec3 camera{pose.camera_m[0], pose.camera_m[1], pose.camera_m[2]};
  const Vec3 light{pose.light_m[0], pose.light_m[1], pose.light_m[2]};
  return {geometry::normalized(light - pose.light_m[3] * point), geometry::normalized(camera - point)};
}

std::vector<Sample> samples_of(const maps::ObservationHeader& header, const maps::ObservationBlock& block,
                               int t, int s, const std::vector<bool>& use) {
  constexpr double kLowest = 0.05;  // cosine: closer to the horizon nothing can be measured
  const Vec3 point = grid_of(header).centre(block.first_column + s, block.first_row + t);
  const std::size_t base = block.texel_index(t, s);
  std::vector<Sample> samples;
  samples.reserve(header.poses.size());
  for (std::size_t p = 0; p < header.poses.size(); ++p) {
    const maps::Validity validity = block.validity[base + p];
    if (!use[p] || validity == maps::Validity::missing) continue;
    const Directions d = directions_at(header.poses[p], point);
    if (d.incident.z < kLowest || d.exitant.z < kLowest) continue;
    Sample sample{d.incident, d.exitant, {}, {}, validity == maps::Validity::saturated};
    bool finite = true;
    for (std::size_t c = 0; c < 3; ++c) {
      sample.value[c] = static_cast<double>(block.value[3 * (base + p) + c]);
      sample.variance[c] = static_cast<double>(block.variance[3 * (base + p) + c]);
      finite = finite && std::isfinite(sample.value[c]) && std::isfinite(sample.variance[c]) &&
               sample.variance[c] >= 0;
    }
    if (finite) samples.push_back(sample);
  }
  return samples;
}

}  // namespace rig::appearance
