// Where what stands in the HDF5 file of an observation map, for its writer and its reader. Private to
// core/maps.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/maps/hdf5_handle.h"
#include "core/maps/observation_map.h"

namespace rig::maps {

/// Version of the layout; a reader refuses greater ones.
inline constexpr int kObservationFormat = 1;

/// The three large datasets: values and variances have a channel axis, validity has none.
struct Layers {
  h5::Handle value, variance, validity;
};

/// Bytes of one tile of `edge` x `edge` texels in the dataset of values.
[[nodiscard]] std::uint64_t tile_bytes(int edge, std::uint64_t poses);

/// kTile, halved until a chunk is smaller than the 4 GiB that HDF5 allows.
[[nodiscard]] int tile_edge(std::uint64_t poses);

/// Access properties of a layer whose chunk cache holds a row of tiles, as far as that is reasonable, and
/// never less than one tile: without it reading one pose of a tile would be a thousand small reads.
[[nodiscard]] h5::Handle layer_access(const ObservationHeader& header);

/// A rectangle of a layer as dataspaces: every pose of it, or one where `pose` is not negative.
struct Selection {
  h5::Handle memory, file;
};
[[nodiscard]] Selection select(hid_t layer, const ObservationBlock& rectangle, int pose, bool channels);

/// Values of `block` without the channel axis.
[[nodiscard]] std::size_t observations(const ObservationBlock& block);

/// Attributes and the geometry of the poses.
[[nodiscard]] base::Result<void> write_header(hid_t file, const ObservationHeader& header);
/// The header of a map of `shape` (rows, columns, poses), without a path in its errors.
[[nodiscard]] base::Result<ObservationHeader> read_header(hid_t file, const std::vector<hsize_t>& shape);
/// Refuses what is no observation map and what is newer.
[[nodiscard]] base::Result<void> check_kind(hid_t file);

}  // namespace rig::maps
