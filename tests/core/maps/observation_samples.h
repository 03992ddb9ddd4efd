// Observation maps full of distinct values.
#pragma once

#include <cmath>
#include <limits>
#include <random>

#include "core/maps/observation_map.h"

namespace rig::maps {

inline ObservationHeader sample_header(int columns, int rows, int poses) {
  ObservationHeader header;
  header.columns = columns;
  header.rows = rows;
  header.width_m = 0.16;
  header.height_m = 0.12;
  header.absolute = true;
  header.name = "Würfelköper, blau";
  header.provenance = {{"program", "rig-assemble 0.1"}, {"scan", "/scans/night 1"}, {"empty", ""}};
  for (int p = 0; p < poses; ++p) {
    PoseGeometry pose;
    pose.row = 7 * p + 3;
    pose.camera_m = {0.1 * p, -0.2, 1.2254};
    pose.light_m = {-0.3, 0.01 * p, 0.9, p % 2 == 0 ? 1.0 : 0.0};
    pose.target_rad = {0.1, 0.2, 0.3, p == 0 ? std::numeric_limits<double>::quiet_NaN() : 0.4};
    for (std::size_t i = 0; i < 12; ++i) pose.camera_from_sample[i] = p + 0.0625 * static_cast<double>(i);
    pose.registration_rms_px = 0.03 / (p + 1);
    header.poses.push_back(pose);
  }
  return header;
}

/// A rectangle whose every number tells its place, so that a swap of any two indices shows.
inline ObservationBlock sample_block(const ObservationHeader& header, int first_row, int rows,
                                     int first_column, int columns) {
  ObservationBlock block;
  block.first_row = first_row;
  block.rows = rows;
  block.first_column = first_column;
  block.columns = columns;
  block.poses = static_cast<int>(header.poses.size());
  block.allocate();
  for (int t = 0; t < rows; ++t) {
    for (int s = 0; s < columns; ++s) {
      for (int p = 0; p < block.poses; ++p) {
        const std::size_t i = block.texel_index(t, s) + static_cast<std::size_t>(p);
        const int place = ((first_row + t) * header.columns + first_column + s) * block.poses + p;
        for (std::size_t c = 0; c < 3; ++c) {
          block.value[3 * i + c] = static_cast<float>(3 * place + static_cast<int>(c));
          block.variance[3 * i + c] = 0.5F + static_cast<float>(3 * place + static_cast<int>(c));
        }
        block.validity[i] = static_cast<Validity>(place % 4);
      }
    }
  }
  return block;
}

inline ObservationBlock whole_map(const ObservationHeader& header) {
  return sample_block(header, 0, header.rows, 0, header.columns);
}

inline base::Result<void> write_map(const std::filesystem::path& path, const ObservationHeader& header) {
  auto writer = ObservationWriter::create(path, header);
  if (!writer) return base::pass(writer);
  for (int t = 0; t < header.rows; t += kTile) {
    const int rows = std::min(kTile, header.rows - t);
    if (auto done = writer->write(sample_block(header, t, rows, 0, header.columns)); !done) return done;
  }
  return writer->finish();
}

inline bool same_texels(const ObservationBlock& a, const ObservationBlock& b) {
  return a.first_row == b.first_row && a.rows == b.rows && a.first_column == b.first_column &&
         a.columns == b.columns && a.poses == b.poses && a.value == b.value && a.variance == b.variance &&
         a.validity == b.validity;
}

}  // namespace rig::maps
