#include "core/maps/observation_layout.h"

#include <algorithm>
#include <cmath>

namespace rig::maps {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using h5::Handle;
using h5::Kept;

namespace {

constexpr const char* kKind = "rigd observation map";
constexpr std::string_view kProvenance = "provenance.";
constexpr hsize_t kChannels = 3;

/// The table of one property of the poses.
struct PoseTable {
  const char* path;
  hsize_t columns;
  const char* units;
  Kept kept;
  double (*get)(const PoseGeometry&, std::size_t);
  void (*set)(PoseGeometry&, std::size_t, double);
};

constexpr std::array<PoseTable, 6> kTables{{
    {"/pose/row", 1, "1", Kept::integer,
     [](const PoseGeometry& p, std::size_t) { return static_cast<double>(p.row); },
     [](PoseGeometry& p, std::size_t, double v) { p.row = std::llround(v); }},
    {"/pose/camera_m", 3, "m", Kept::real, [](const PoseGeometry& p, std::size_t i) { return p.camera_m[i]; },
     [](PoseGeometry& p, std::size_t i, double v) { p.camera_m[i] = v; }},
    {"/pose/light_m", 4, "m, homogeneous", Kept::real,
     [](const PoseGeometry& p, std::size_t i) { return p.light_m[i]; },
     [](PoseGeometry& p, std::size_t i, double v) { p.light_m[i] = v; }},
    {"/pose/target_rad", 4, "rad", Kept::real,
     [](const PoseGeometry& p, std::size_t i) { return p.target_rad[i]; },
     [](PoseGeometry& p, std::size_t i, double v) { p.target_rad[i] = v; }},
    {"/pose/camera_from_sample", 12, "3 x 4 row-major: rotation (1), translation (m)", Kept::real,
     [](const PoseGeometry& p, std::size_t i) { return p.camera_from_sample[i]; },
     [](PoseGeometry& p, std::size_t i, double v) { p.camera_from_sample[i] = v; }},
    {"/pose/registration_rms_px", 1, "px", Kept::real,
     [](const PoseGeometry& p, std::size_t) { return p.registration_rms_px; },
     [](PoseGeometry& p, std::size_t, double v) { p.registration_rms_px = v; }},
}};

std::vector<hsize_t> table_shape(const PoseTable& table, hsize_t poses) {
  return table.columns == 1 ? std::vector<hsize_t>{poses} : std::vector<hsize_t>{poses, table.columns};
}

}  // namespace

std::uint64_t tile_bytes(int edge, std::uint64_t poses) {
  return static_cast<std::uint64_t>(edge) * static_cast<std::uint64_t>(edge) * poses * kChannels *
         sizeof(float);
}

int tile_edge(std::uint64_t poses) {
  constexpr std::uint64_t kMostBytes = (std::uint64_t{1} << 32) - 1;
  int edge = kTile;
  while (edge > 1 && tile_bytes(edge, poses) > kMostBytes) edge /= 2;
  return edge;
}

Handle layer_access(const ObservationHeader& header) {
  constexpr std::uint64_t kMostCache = std::uint64_t{64} << 20;
  // A prime, and a hundred times as many slots as a row of tiles of a large map has.
  constexpr std::size_t kSlots = 12421;
  // A tile that was read or written to its end is the first to go.
  constexpr double kDropWholeTilesFirst = 1.0;
  const int edge = tile_edge(header.poses.size());
  const std::uint64_t tile = tile_bytes(edge, header.poses.size());
  const auto tiles = static_cast<std::uint64_t>((header.columns + edge - 1) / edge);
  const std::uint64_t cache = std::max(tile, std::min(tile * tiles, kMostCache));
  Handle access(H5Pcreate(H5P_DATASET_ACCESS), &H5Pclose);
  H5Pset_chunk_cache(access.get(), kSlots, cache, kDropWholeTilesFirst);
  return access;
}

std::size_t observations(const ObservationBlock& block) {
  return static_cast<std::size_t>(block.rows) * static_cast<std::size_t>(block.columns) *
         static_cast<std::size_t>(block.poses);
}

Selection select(hid_t layer, const ObservationBlock& rectangle, int pose, bool channels) {
  std::vector<hsize_t> start{static_cast<hsize_t>(rectangle.first_row),
                             static_cast<hsize_t>(rectangle.first_column),
                             pose >= 0 ? static_cast<hsize_t>(pose) : 0};
  std::vector<hsize_t> count{static_cast<hsize_t>(rectangle.rows), static_cast<hsize_t>(rectangle.columns),
                             static_cast<hsize_t>(rectangle.poses)};
  if (channels) {
    start.push_back(0);
    count.push_back(kChannels);
  }
  Selection s{Handle(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), &H5Sclose),
              Handle(H5Dget_space(layer), &H5Sclose)};
  H5Sselect_hyperslab(s.file.get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
  return s;
}

Result<void> write_header(hid_t file, const ObservationHeader& header) {
  const bool brdf = header.quantity == Quantity::brdf;
  const auto text = [&](const std::string& name, const std::string& value) {
    return h5::write_text(file, name, value);
  };
  const auto number = [&](const std::string& name, double value, Kept kept) {
    return h5::write_number(file, name, value, kept);
  };
  for (auto& done :
       {text("kind", kKind), number("format", kObservationFormat, Kept::integer),
        number("width_m", header.width_m, Kept::real), number("height_m", header.height_m, Kept::real),
        text("quantity", brdf ? "brdf" : "radiance"), text("units", brdf ? "sr^-1" : "1"),
        number("absolute", header.absolute ? 1 : 0, Kept::integer), text("name", header.name),
        text("channels", "linear sRGB: R, G, B"),
        text("frame",
             "sample: origin at the centre, x right, y up, z outward; row 0 is the edge of least y")}) {
    if (!done) return done;
  }
  for (const auto& [key, value] : header.provenance) {
    if (auto done = text(std::string(kProvenance) + key, value); !done) return done;
  }
  for (const PoseTable& table : kTables) {
    std::vector<double> values;
    values.reserve(header.poses.size() * table.columns);
    for (const PoseGeometry& pose : header.poses) {
      for (std::size_t i = 0; i < table.columns; ++i) values.push_back(table.get(pose, i));
    }
    auto done = h5::write_table(file, table.path, table_shape(table, header.poses.size()), values,
                                table.units, table.kept);
    if (!done) return done;
  }
  return {};
}

Result<void> check_kind(hid_t file) {
  const auto kind = h5::read_text(file, "kind");
  if (!kind || *kind != kKind) {
    return fail(ErrorCode::bad_input, "is an HDF5 file, but no observation map", {},
                "rig assemble and rig import write observation maps");
  }
  const auto format = h5::read_number(file, "format");
  if (!format) return pass(format);
  if (*format > kObservationFormat) {
    return fail(ErrorCode::newer,
                fmt::format("format {} is newer than this program reads ({})", *format, kObservationFormat),
                {}, "use a newer version of rigd");
  }
  return {};
}

Result<ObservationHeader> read_header(hid_t file, const std::vector<hsize_t>& shape) {
  ObservationHeader header;
  header.rows = static_cast<int>(shape[0]);
  header.columns = static_cast<int>(shape[1]);
  const auto width = h5::read_number(file, "width_m");
  const auto height = h5::read_number(file, "height_m");
  const auto absolute = h5::read_number(file, "absolute");
  const auto quantity = h5::read_text(file, "quantity");
  const auto name = h5::read_text(file, "name");
  if (!width) return pass(width);
  if (!height) return pass(height);
  if (!absolute) return pass(absolute);
  if (!quantity) return pass(quantity);
  if (!name) return pass(name);
  if (!(*width > 0) || !(*height > 0) || !std::isfinite(*width) || !std::isfinite(*height)) {
    return fail(ErrorCode::damaged, fmt::format("the sample's size is {} x {} m", *width, *height));
  }
  if (*quantity != "brdf" && *quantity != "radiance") {
    return fail(ErrorCode::damaged, fmt::format("its quantity is '{}', not brdf or radiance", *quantity));
  }
  header.width_m = *width;
  header.height_m = *height;
  header.absolute = *absolute != 0;
  header.quantity = *quantity == "brdf" ? Quantity::brdf : Quantity::radiance;
  header.name = *name;
  for (const std::string& attribute : h5::attribute_names(file)) {
    if (attribute.rfind(kProvenance, 0) != 0) continue;
    auto value = h5::read_text(file, attribute);
    if (!value) return pass(value);
    header.provenance[attribute.substr(kProvenance.size())] = std::move(*value);
  }
  // The tables must be there before memory for their poses is.
  std::vector<std::vector<double>> values;
  for (const PoseTable& table : kTables) {
    auto column = h5::read_table(file, table.path, table_shape(table, shape[2]));
    if (!column) return pass(column);
    values.push_back(std::move(*column));
  }
  header.poses.resize(shape[2]);
  for (std::size_t t = 0; t < kTables.size(); ++t) {
    const std::size_t columns = kTables[t].columns;
    for (std::size_t i = 0; i < values[t].size(); ++i) {
      kTables[t].set(header.poses[i / columns], i % columns, values[t][i]);
    }
  }
  return header;
}

}  // namespace rig::maps
