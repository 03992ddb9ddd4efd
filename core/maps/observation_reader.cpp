#include <algorithm>
#include <limits>
#include <system_error>

#include "core/maps/observation_layout.h"
#include "core/maps/observation_map.h"

namespace rig::maps {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using h5::Handle;

namespace {

tl::unexpected<base::Error> at(base::Error error, const std::filesystem::path& path) {
  error.where = path.string();
  return tl::unexpected(std::move(error));
}

// A dataset of the extent (rows, columns, poses[, 3]); `shape` is taken from it where it is still empty.
Result<Handle> open_layer(hid_t file, const char* name, std::size_t dimensions, std::vector<hsize_t>& shape,
                          hid_t access) {
  Handle layer(H5Dopen2(file, name, access), &H5Dclose);
  if (!layer.valid()) return fail(ErrorCode::damaged, fmt::format("dataset '{}' is missing", name));
  const std::vector<hsize_t> found = h5::shape_of(layer.get());
  if (shape.empty()) shape = found;
  constexpr hsize_t kMost = std::numeric_limits<int>::max();
  bool fits = found.size() == dimensions && shape.size() >= 3 && (dimensions < 4 || found[3] == 3);
  for (std::size_t i = 0; fits && i < 3; ++i) {
    fits = found[i] == shape[i] && found[i] > 0 && found[i] < kMost;
  }
  if (!fits) {
    return fail(ErrorCode::damaged,
                fmt::format("dataset '{}' has the wrong shape: [{}]", name, fmt::join(found, ", ")));
  }
  return layer;
}

}  // namespace

struct ObservationReader::State {
  std::filesystem::path path;
  ObservationHeader header;
  Handle file;
  Layers layers;

  // The rectangle of `block`, all poses or one.
  [[nodiscard]] Result<void> fill(int pose, ObservationBlock& block) const {
    block.allocate();
    const Selection rgb = select(layers.value.get(), block, pose, true);
    const Selection flags = select(layers.validity.get(), block, pose, false);
    const auto get = [](const Handle& layer, hid_t type, const Selection& s, void* data) {
      return H5Dread(layer.get(), type, s.memory.get(), s.file.get(), H5P_DEFAULT, data) >= 0;
    };
    if (!get(layers.value, H5T_NATIVE_FLOAT, rgb, block.value.data()) ||
        !get(layers.variance, H5T_NATIVE_FLOAT, rgb, block.variance.data()) ||
        !get(layers.validity, H5T_NATIVE_UINT8, flags, block.validity.data())) {
      return fail(ErrorCode::damaged, fmt::format("cannot read texels: {}", h5::last_error()), path.string());
    }
    const auto unknown = std::find_if(block.validity.begin(), block.validity.end(),
                                      [](Validity v) { return v > Validity::dark; });
    if (unknown != block.validity.end()) {
      return fail(ErrorCode::damaged, fmt::format("validity {} has no meaning", static_cast<int>(*unknown)),
                  path.string());
    }
    return {};
  }
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
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    return fail(ErrorCode::not_found, "there is no such file", path.string());
  }
  auto state = std::make_unique<State>();
  state->path = path;
  state->file = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), &H5Fclose);
  if (!state->file.valid()) {
    const std::string reason = h5::last_error();
    if (H5Fis_hdf5(path.c_str()) > 0) {
      return fail(ErrorCode::damaged, fmt::format("the HDF5 file cannot be opened: {}", reason),
                  path.string(), "make the map again");
    }
    return fail(ErrorCode::bad_input, fmt::format("is no HDF5 file: {}", reason), path.string());
  }
  const hid_t file = state->file.get();
  if (auto kind = check_kind(file); !kind) return at(kind.error(), path);
  // The size of a tile, which the cache has to fit, is known only from the layer itself.
  std::vector<hsize_t> shape;
  {
    const auto value = open_layer(file, "value", 4, shape, H5P_DEFAULT);
    if (!value) return at(value.error(), path);
  }
  auto header = read_header(file, shape);
  if (!header) return at(header.error(), path);
  state->header = std::move(*header);
  const Handle access = layer_access(state->header);
  auto value = open_layer(file, "value", 4, shape, access.get());
  if (!value) return at(value.error(), path);
  auto variance = open_layer(file, "variance", 4, shape, access.get());
  if (!variance) return at(variance.error(), path);
  auto validity = open_layer(file, "validity", 3, shape, access.get());
  if (!validity) return at(validity.error(), path);
  state->layers = {std::move(*value), std::move(*variance), std::move(*validity)};
  return ObservationReader(std::move(state));
}

Result<ObservationBlock> ObservationReader::read(int first_row, int rows, int first_column,
                                                 int columns) const {
  const ObservationHeader& h = state_->header;
  const auto within = [](int first, int count, int all) {
    return first >= 0 && count > 0 && count <= all && first <= all - count;
  };
  if (!within(first_row, rows, h.rows) || !within(first_column, columns, h.columns)) {
    return fail(
        ErrorCode::bad_input,
        fmt::format("the rectangle of {} x {} texels at column {}, row {} lies outside the map of {} x {}",
                    columns, rows, first_column, first_row, h.columns, h.rows),
        state_->path.string());
  }
  ObservationBlock block;
  block.first_row = first_row;
  block.rows = rows;
  block.first_column = first_column;
  block.columns = columns;
  block.poses = static_cast<int>(h.poses.size());
  if (auto done = state_->fill(-1, block); !done) return pass(done);
  return block;
}

Result<ObservationBlock> ObservationReader::read_pose(int pose) const {
  const ObservationHeader& h = state_->header;
  if (pose < 0 || static_cast<std::size_t>(pose) >= h.poses.size()) {
    return fail(ErrorCode::bad_input, fmt::format("there is no pose {} of {}", pose, h.poses.size()),
                state_->path.string());
  }
  ObservationBlock block;
  block.rows = h.rows;
  block.columns = h.columns;
  block.poses = 1;
  if (auto done = state_->fill(pose, block); !done) return pass(done);
  return block;
}

}  // namespace rig::maps
