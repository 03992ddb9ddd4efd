#include "core/maps/observation_map.h"

#include <algorithm>
#include <cmath>
#include <fcntl.h>
#include <limits>
#include <unistd.h>

#include "core/base/files.h"
#include "core/maps/hdf5_handle.h"

namespace rig::maps {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using h5::Handle;

namespace {

constexpr int kFormat = 1;
constexpr const char* kKind = "rigd observation map";
constexpr const char* kProvenance = "provenance.";

// The three large datasets: values and variances have a channel axis, validity has none.
struct Layers {
  Handle value, variance, validity;
};

std::size_t expected_values(const ObservationBlock& b) {
  return static_cast<std::size_t>(b.rows) * static_cast<std::size_t>(b.columns) *
         static_cast<std::size_t>(b.poses);
}

int tile_edge(std::size_t poses) {
  // A chunk may not reach 4 GiB; one of at most 64 MiB also keeps caches sane.
  int edge = kTile;
  while (edge > 1 &&
         static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge) * poses * 12 > (64U << 20)) {
    edge /= 2;
  }
  return edge;
}

Result<Handle> make_layer(hid_t file, const ObservationHeader& header, const char* name, hid_t type,
                          bool channels) {
  const auto poses = static_cast<hsize_t>(header.poses.size());
  const auto edge = static_cast<hsize_t>(tile_edge(header.poses.size()));
  std::vector<hsize_t> shape{static_cast<hsize_t>(header.rows), static_cast<hsize_t>(header.columns), poses};
  std::vector<hsize_t> chunk{std::min(edge, shape[0]), std::min(edge, shape[1]), poses};
  if (channels) {
    shape.push_back(3);
    chunk.push_back(3);
  }
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), &H5Sclose);
  const Handle plan(H5Pcreate(H5P_DATASET_CREATE), &H5Pclose);
  H5Pset_chunk(plan.get(), static_cast<int>(chunk.size()), chunk.data());
  // Every chunk is written whole; filling it first would write the file twice.
  H5Pset_fill_time(plan.get(), H5D_FILL_TIME_IFSET);
  Handle layer(H5Dcreate2(file, name, type, space.get(), H5P_DEFAULT, plan.get(), H5P_DEFAULT), &H5Dclose);
  if (!layer.valid()) return fail(ErrorCode::io, fmt::format("cannot make '{}': {}", name, h5::last_error()));
  return layer;
}

// The selection of a block's rectangle in a layer's file space.
struct Selection {
  Handle memory, file;
};

Selection select(hid_t layer, const ObservationBlock& b, int pose, bool channels) {
  const bool one = pose >= 0;
  std::vector<hsize_t> start{static_cast<hsize_t>(b.first_row), static_cast<hsize_t>(b.first_column),
                             one ? static_cast<hsize_t>(pose) : 0};
  std::vector<hsize_t> count{static_cast<hsize_t>(b.rows), static_cast<hsize_t>(b.columns),
                             static_cast<hsize_t>(b.poses)};
  if (channels) {
    start.push_back(0);
    count.push_back(3);
  }
  Selection s{Handle(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), &H5Sclose),
              Handle(H5Dget_space(layer), &H5Sclose)};
  H5Sselect_hyperslab(s.file.get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
  return s;
}

Result<void> write_header(hid_t file, const ObservationHeader& header) {
  const auto text = [&](const std::string& name, const std::string& value) {
    return h5::write_text(file, name, value);
  };
  const auto number = [&](const std::string& name, double value) {
    return h5::write_number(file, name, value);
  };
  for (auto& done :
       {text("kind", kKind), number("format", kFormat), number("width_m", header.width_m),
        number("height_m", header.height_m),
        text("quantity", header.quantity == Quantity::brdf ? "brdf" : "radiance"),
        text("units", header.quantity == Quantity::brdf ? "sr^-1" : "1"),
        number("absolute", header.absolute ? 1 : 0), text("name", header.name),
        text("channels", "linear sRGB: R, G, B"),
        text("frame",
             "sample: origin at the centre, x right, y up, z outward; row 0 is the edge of least y")}) {
    if (!done) return done;
  }
  for (const auto& [key, value] : header.provenance) {
    if (auto done = text(kProvenance + key, value); !done) return done;
  }
  const auto poses = static_cast<hsize_t>(header.poses.size());
  const auto column = [&](const char* name, hsize_t width, const char* units, auto&& get) {
    std::vector<double> values;
    values.reserve(poses * width);
    for (const PoseGeometry& p : header.poses) {
      for (hsize_t i = 0; i < width; ++i) values.push_back(get(p, i));
    }
    return h5::write_doubles(file, name,
                             width == 1 ? std::vector<hsize_t>{poses} : std::vector<hsize_t>{poses, width},
                             values, units);
  };
  using P = const PoseGeometry&;
  for (auto& done :
       {column("/pose/row", 1, "1", [](P p, hsize_t) { return static_cast<double>(p.row); }),
        column("/pose/camera_m", 3, "m", [](P p, hsize_t i) { return p.camera_m[i]; }),
        column("/pose/light_m", 4, "m, homogeneous", [](P p, hsize_t i) { return p.light_m[i]; }),
        column("/pose/target_rad", 4, "rad", [](P p, hsize_t i) { return p.target_rad[i]; }),
        column("/pose/camera_from_sample", 12, "3 x 4, rotation and m",
               [](P p, hsize_t i) { return p.camera_from_sample[i]; }),
        column("/pose/registration_rms_px", 1, "px", [](P p, hsize_t) { return p.registration_rms_px; })}) {
    if (!done) return done;
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
  if (!(*width > 0) || !(*height > 0)) return fail(ErrorCode::damaged, "the sample's size is not positive");
  header.width_m = *width;
  header.height_m = *height;
  header.absolute = *absolute != 0;
  header.quantity = *quantity == "brdf" ? Quantity::brdf : Quantity::radiance;
  header.name = *name;
  for (const std::string& attribute : h5::attribute_names(file)) {
    if (attribute.rfind(kProvenance, 0) != 0) continue;
    if (auto value = h5::read_text(file, attribute)) {
      header.provenance[attribute.substr(std::string(kProvenance).size())] = *value;
    }
  }
  header.poses.resize(shape[2]);
  const auto column = [&](const char* path, hsize_t columns, auto&& set) -> Result<void> {
    const auto values = h5::read_doubles(
        file, path, columns == 1 ? std::vector<hsize_t>{shape[2]} : std::vector<hsize_t>{shape[2], columns});
    if (!values) return pass(values);
    for (std::size_t i = 0; i < values->size(); ++i)
      set(header.poses[i / columns], i % columns, (*values)[i]);
    return {};
  };
  using P = PoseGeometry&;
  for (auto& done : {column("/pose/row", 1, [](P p, std::size_t, double v) { p.row = std::llround(v); }),
                     column("/pose/camera_m", 3, [](P p, std::size_t i, double v) { p.camera_m[i] = v; }),
                     column("/pose/light_m", 4, [](P p, std::size_t i, double v) { p.light_m[i] = v; }),
                     column("/pose/target_rad", 4, [](P p, std::size_t i, double v) { p.target_rad[i] = v; }),
                     column("/pose/camera_from_sample", 12,
                            [](P p, std::size_t i, double v) { p.camera_from_sample[i] = v; }),
                     column("/pose/registration_rms_px", 1,
                            [](P p, std::size_t, double v) { p.registration_rms_px = v; })}) {
    if (!done) return pass(done);
  }
  return header;
}

base::Error at(base::Error error, const std::filesystem::path& path) {
  if (error.where.empty()) error.where = path.string();
  return error;
}

}  // namespace

void ObservationBlock::allocate() {
  const std::size_t n = expected_values(*this);
  value.assign(3 * n, 0.0F);
  variance.assign(3 * n, 0.0F);
  validity.assign(n, Validity::missing);
}

// ---- Writer
// ----------------------------------------------------------------------------------------------------

struct ObservationWriter::State {
  std::filesystem::path path, part;
  ObservationHeader header;
  Handle file;
  Layers layers;
  bool finished = false;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (finished) return;
    layers = {};
    file.reset();
    std::error_code nothing_left_to_do;
    std::filesystem::remove(part, nothing_left_to_do);
  }
};

ObservationWriter::ObservationWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
ObservationWriter::ObservationWriter(ObservationWriter&&) noexcept = default;
ObservationWriter& ObservationWriter::operator=(ObservationWriter&&) noexcept = default;
ObservationWriter::~ObservationWriter() = default;

Result<ObservationWriter> ObservationWriter::create(const std::filesystem::path& path,
                                                    const ObservationHeader& header) {
  if (header.columns <= 0 || header.rows <= 0 || header.poses.empty() || !(header.width_m > 0) ||
      !(header.height_m > 0)) {
    return fail(ErrorCode::bad_input, "an observation map needs texels, a size and at least one pose",
                path.string());
  }
  h5::keep_quiet();
  auto state = std::make_unique<State>();
  state->path = path;
  state->part = path;
  state->part += ".part";
  state->header = header;
  state->file = Handle(H5Fcreate(state->part.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), &H5Fclose);
  if (!state->file.valid()) {
    return fail(ErrorCode::io, fmt::format("cannot create: {}", h5::last_error()), state->part.string());
  }
  if (auto done = write_header(state->file.get(), header); !done)
    return tl::unexpected(at(done.error(), path));
  const auto make = [&](Handle& layer, const char* name, hid_t type, bool channels) -> Result<void> {
    auto made = make_layer(state->file.get(), header, name, type, channels);
    if (!made) return tl::unexpected(at(made.error(), path));
    layer = std::move(*made);
    return {};
  };
  if (auto done = make(state->layers.value, "value", H5T_IEEE_F32LE, true); !done) return pass(done);
  if (auto done = make(state->layers.variance, "variance", H5T_IEEE_F32LE, true); !done) return pass(done);
  if (auto done = make(state->layers.validity, "validity", H5T_STD_U8LE, false); !done) return pass(done);
  return ObservationWriter(std::move(state));
}

Result<void> ObservationWriter::write(const ObservationBlock& block) {
  const ObservationHeader& h = state_->header;
  const std::size_t n = expected_values(block);
  const bool inside = block.first_row >= 0 && block.first_column >= 0 &&
                      block.first_row + block.rows <= h.rows &&
                      block.first_column + block.columns <= h.columns;
  if (!inside || static_cast<std::size_t>(block.poses) != h.poses.size() || block.value.size() != 3 * n ||
      block.variance.size() != 3 * n || block.validity.size() != n) {
    return fail(ErrorCode::bad_input, "a block does not fit the map", state_->path.string());
  }
  const Selection rgb = select(state_->layers.value.get(), block, -1, true);
  const Selection flags = select(state_->layers.validity.get(), block, -1, false);
  const auto put = [](hid_t layer, hid_t type, const Selection& s, const void* data) {
    return H5Dwrite(layer, type, s.memory.get(), s.file.get(), H5P_DEFAULT, data) >= 0;
  };
  if (!put(state_->layers.value.get(), H5T_NATIVE_FLOAT, rgb, block.value.data()) ||
      !put(state_->layers.variance.get(), H5T_NATIVE_FLOAT, rgb, block.variance.data()) ||
      !put(state_->layers.validity.get(), H5T_NATIVE_UINT8, flags, block.validity.data())) {
    return fail(ErrorCode::io, fmt::format("cannot write: {}", h5::last_error()), state_->part.string());
  }
  return {};
}

Result<void> ObservationWriter::finish() {
  state_->layers = {};
  const bool flushed = H5Fflush(state_->file.get(), H5F_SCOPE_GLOBAL) >= 0;
  state_->file.reset();
  if (!flushed)
    return fail(ErrorCode::io, fmt::format("cannot flush: {}", h5::last_error()), state_->part.string());
  const int fd = ::open(state_->part.c_str(), O_RDONLY | O_CLOEXEC);
  const bool on_disk = fd >= 0 && ::fsync(fd) == 0;
  if (fd >= 0) ::close(fd);
  if (!on_disk) return fail(ErrorCode::io, "cannot flush to disk", state_->part.string());
  if (auto renamed = base::rename_durably(state_->part, state_->path); !renamed) return renamed;
  state_->finished = true;
  return {};
}

// ---- Reader
// ----------------------------------------------------------------------------------------------------

struct ObservationReader::State {
  std::filesystem::path path;
  ObservationHeader header;
  Handle file;
  Layers layers;
};

ObservationReader::ObservationReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
ObservationReader::ObservationReader(ObservationReader&&) noexcept = default;
ObservationReader& ObservationReader::operator=(ObservationReader&&) noexcept = default;
ObservationReader::~ObservationReader() = default;

const ObservationHeader& ObservationReader::header() const {
  return state_->header;
}

Result<ObservationReader> ObservationReader::open(const std::filesystem::path& path) {
  h5::keep_quiet();
  if (std::error_code error; !std::filesystem::exists(path, error)) {
    return fail(ErrorCode::not_found, "there is no such file", path.string());
  }
  auto state = std::make_unique<State>();
  state->path = path;
  state->file = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), &H5Fclose);
  if (!state->file.valid()) {
    return fail(ErrorCode::damaged, fmt::format("is no readable HDF5 file: {}", h5::last_error()),
                path.string());
  }
  const auto kind = h5::read_text(state->file.get(), "kind");
  if (!kind || *kind != kKind) {
    return fail(ErrorCode::bad_input, "is an HDF5 file, but no observation map", path.string());
  }
  const auto format = h5::read_number(state->file.get(), "format");
  if (!format) return tl::unexpected(at(format.error(), path));
  if (*format > kFormat) {
    return fail(ErrorCode::newer,
                fmt::format("format {} is newer than this program reads ({})", *format, kFormat),
                path.string(), "use a newer version");
  }
  std::vector<hsize_t> shape;
  const auto open_layer = [&](Handle& layer, const char* name, std::size_t dimensions) -> Result<void> {
    layer = Handle(H5Dopen2(state->file.get(), name, H5P_DEFAULT), &H5Dclose);
    if (!layer.valid())
      return fail(ErrorCode::damaged, fmt::format("dataset '{}' is missing", name), path.string());
    const Handle space(H5Dget_space(layer.get()), &H5Sclose);
    std::vector<hsize_t> found(
        static_cast<std::size_t>(std::max(H5Sget_simple_extent_ndims(space.get()), 0)));
    H5Sget_simple_extent_dims(space.get(), found.data(), nullptr);
    if (shape.empty()) shape = found;
    constexpr hsize_t kMost = std::numeric_limits<int>::max();
    bool fits = found.size() == dimensions && (dimensions < 4 || found[3] == 3);
    for (std::size_t i = 0; fits && i < 3; ++i)
      fits = found[i] == shape[i] && found[i] > 0 && found[i] < kMost;
    if (!fits)
      return fail(ErrorCode::damaged, fmt::format("dataset '{}' has the wrong shape", name), path.string());
    return {};
  };
  if (auto done = open_layer(state->layers.value, "value", 4); !done) return pass(done);
  if (auto done = open_layer(state->layers.variance, "variance", 4); !done) return pass(done);
  if (auto done = open_layer(state->layers.validity, "validity", 3); !done) return pass(done);
  auto header = read_header(state->file.get(), shape);
  if (!header) return tl::unexpected(at(header.error(), path));
  state->header = std::move(*header);
  return ObservationReader(std::move(state));
}

namespace {

Result<void> fill(const Layers& layers, const std::filesystem::path& path, int pose,
                  ObservationBlock& block) {
  block.allocate();
  const Selection rgb = select(layers.value.get(), block, pose, true);
  const Selection flags = select(layers.validity.get(), block, pose, false);
  const auto get = [](hid_t layer, hid_t type, const Selection& s, void* data) {
    return H5Dread(layer, type, s.memory.get(), s.file.get(), H5P_DEFAULT, data) >= 0;
  };
  if (!get(layers.value.get(), H5T_NATIVE_FLOAT, rgb, block.value.data()) ||
      !get(layers.variance.get(), H5T_NATIVE_FLOAT, rgb, block.variance.data()) ||
      !get(layers.validity.get(), H5T_NATIVE_UINT8, flags, block.validity.data())) {
    return fail(ErrorCode::damaged, fmt::format("cannot read texels: {}", h5::last_error()), path.string());
  }
  for (Validity& v : block.validity) {
    if (v > Validity::dark) v = Validity::missing;
  }
  return {};
}

}  // namespace

Result<ObservationBlock> ObservationReader::read(int first_row, int rows, int first_column,
                                                 int columns) const {
  const ObservationHeader& h = state_->header;
  if (first_row < 0 || rows <= 0 || first_row + rows > h.rows || first_column < 0 || columns <= 0 ||
      first_column + columns > h.columns) {
    return fail(ErrorCode::bad_input, "the rectangle lies outside the map", state_->path.string());
  }
  ObservationBlock block;
  block.first_row = first_row;
  block.rows = rows;
  block.first_column = first_column;
  block.columns = columns;
  block.poses = static_cast<int>(h.poses.size());
  if (auto done = fill(state_->layers, state_->path, -1, block); !done) return pass(done);
  return block;
}

Result<ObservationBlock> ObservationReader::read_pose(int pose) const {
  const ObservationHeader& h = state_->header;
  if (pose < 0 || static_cast<std::size_t>(pose) >= h.poses.size()) {
    return fail(ErrorCode::bad_input, fmt::format("there is no pose {}", pose), state_->path.string());
  }
  ObservationBlock block;
  block.rows = h.rows;
  block.columns = h.columns;
  block.poses = 1;
  if (auto done = fill(state_->layers, state_->path, pose, block); !done) return pass(done);
  return block;
}

}  // namespace rig::maps
