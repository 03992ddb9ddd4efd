// Small observation maps of a material that is known at every texel.
#pragma once

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>

#include "appearance/lafortune.h"
#include "appearance/texel.h"
#include "core/base/random.h"
#include "core/geometry/directions.h"
#include "core/maps/observation_map.h"

namespace rig::test {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A pose as of a photograph from elsewhere: no motors, no fiducials.
inline maps::PoseGeometry pose_of(std::int64_t row, geometry::Vec3 camera_m, geometry::Vec3 light_m) {
  maps::PoseGeometry pose;
  pose.row = row;
  pose.camera_m = {camera_m.x, camera_m.y, camera_m.z};
  pose.light_m = {light_m.x, light_m.y, light_m.z, 1};
  pose.target_rad.fill(kUnknown);
  pose.camera_from_sample.fill(kUnknown);
  pose.registration_rms_px = kUnknown;
  return pose;
}

inline maps::ObservationHeader header_of(int columns, int rows, std::vector<maps::PoseGeometry> poses) {
  maps::ObservationHeader header;
  header.columns = columns;
  header.rows = rows;
  header.width_m = 0.02 * columns;
  header.height_m = 0.02 * rows;
  header.absolute = true;
  header.name = "known";
  header.provenance = {{"program", "a test"}, {"scan", "/scans/known"}};
  header.poses = std::move(poses);
  return header;
}

/// Light and camera a metre away, half of the cameras near the mirror direction, where a lobe shows.
inline std::vector<maps::PoseGeometry> spread_poses(int count, std::uint64_t seed) {
  base::Random random(seed);
  std::vector<maps::PoseGeometry> poses;
  for (int p = 0; p < count; ++p) {
    const auto any = [&random] {
      return geometry::direction_from_polar({random.uniform(0, 1.1), random.uniform(-3.14, 3.14)});
    };
    const geometry::Vec3 light = any();
    geometry::Vec3 camera = any();
    if (p % 2 == 0) {
      const geometry::Vec3 m = geometry::mirrored(light);
      camera = geometry::normalized({m.x + random.uniform(-0.2, 0.2), m.y + random.uniform(-0.2, 0.2), m.z});
    }
    poses.push_back(pose_of(3 * p, camera, light));
  }
  return poses;
}

/// One value of a map, to be changed before it is written.
struct Observed {
  int s, t, pose;
  std::array<float, 3> value;
  float variance = 1e-8F;
  maps::Validity validity = maps::Validity::good;
};
using Change = std::function<void(Observed&)>;
using Material = std::function<appearance::Lafortune(int s, int t)>;

/// What `material` looks like in every pose, changed by `change`, as an observation map.
inline void write_known_map(
    const std::filesystem::path& path, const maps::ObservationHeader& header, const Material& material,
    const Change& change = [](Observed&) {}) {
  maps::ObservationBlock block;
  block.rows = header.rows;
  block.columns = header.columns;
  block.poses = static_cast<int>(header.poses.size());
  block.allocate();
  const auto grid = appearance::grid_of(header);
  for (int t = 0; t < header.rows; ++t) {
    for (int s = 0; s < header.columns; ++s) {
      const appearance::Lafortune model = material(s, t);
      for (int p = 0; p < block.poses; ++p) {
        const auto d =
            appearance::directions_at(header.poses[static_cast<std::size_t>(p)], grid.centre(s, t));
        Observed observed{s, t, p, {}};
        for (std::size_t c = 0; c < 3; ++c) {
          observed.value[c] = static_cast<float>(appearance::evaluate(model, d.incident, d.exitant, c));
        }
        change(observed);
        const std::size_t at = block.texel_index(t, s) + static_cast<std::size_t>(p);
        for (std::size_t c = 0; c < 3; ++c) {
          block.value[3 * at + c] = observed.value[c];
          block.variance[3 * at + c] = observed.variance;
        }
        block.validity[at] = observed.validity;
      }
    }
  }
  auto writer = maps::ObservationWriter::create(path, header);
  ASSERT_TRUE(writer.has_value()) << writer.error().text();
  const auto written = writer->write(block);
  ASSERT_TRUE(written.has_value()) << written.error().text();
  const auto finished = writer->finish();
  ASSERT_TRUE(finished.has_value()) << finished.error().text();
}

}  // namespace rig::test
