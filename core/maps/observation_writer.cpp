#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <system_error>
#include <unistd.h>

#include "core/base/files.h"
#include "core/maps/observation_layout.h"
#include "core/maps/observation_map.h"

namespace rig::maps {

using base::ErrorCode;
using base::fail;
using base::Result;
using h5::Handle;

namespace {

tl::unexpected<base::Error> unwritten(const std::filesystem::path& part) {
  return fail(ErrorCode::io, fmt::format("cannot write: {}", h5::last_error()), part.string(),
              "is there space left?");
}

Result<void> flush_to_disk(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool flushed = fd >= 0 && ::fsync(fd) == 0;
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (flushed) return {};
  return fail(ErrorCode::io, fmt::format("cannot flush: {}", std::strerror(error)), path.string());
}

Result<Handle> make_layer(hid_t file, const ObservationHeader& header, const char* name, hid_t type,
                          bool channels) {
  const auto poses = static_cast<hsize_t>(header.poses.size());
  const auto edge = static_cast<hsize_t>(tile_edge(poses));
  std::vector<hsize_t> shape{static_cast<hsize_t>(header.rows), static_cast<hsize_t>(header.columns), poses};
  std::vector<hsize_t> chunk{std::min(edge, shape[0]), std::min(edge, shape[1]), poses};
  if (channels) {
    shape.push_back(3);
    chunk.push_back(3);
  }
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), &H5Sclose);
  const Handle plan(H5Pcreate(H5P_DATASET_CREATE), &H5Pclose);
  H5Pset_chunk(plan.get(), static_cast<int>(chunk.size()), chunk.data());
  // Tiles are written whole; filling them first would write the file twice.
  H5Pset_fill_time(plan.get(), H5D_FILL_TIME_IFSET);
  H5Pset_obj_track_times(plan.get(), false);
  const Handle access = layer_access(header);
  Handle layer(H5Dcreate2(file, name, type, space.get(), H5P_DEFAULT, plan.get(), access.get()), &H5Dclose);
  if (!layer.valid()) return fail(ErrorCode::io, fmt::format("cannot make '{}': {}", name, h5::last_error()));
  return layer;
}

Result<void> check_header(const ObservationHeader& header, const std::filesystem::path& path) {
  if (header.columns > 0 && header.rows > 0 && !header.poses.empty() && header.width_m > 0 &&
      header.height_m > 0 && std::isfinite(header.width_m) && std::isfinite(header.height_m)) {
    return {};
  }
  return fail(ErrorCode::bad_input, "an observation map needs texels, a size and at least one pose",
              path.string());
}

Result<void> check_place(const std::filesystem::path& path) {
  // A rename would exchange a folder in the way and remove it with all that is in it.
  if (std::error_code absent; std::filesystem::is_directory(path, absent)) {
    return fail(ErrorCode::refused, "is a folder; a map cannot take its place", path.string());
  }
  return {};
}

}  // namespace

struct ObservationWriter::State {
  std::filesystem::path path, part;
  ObservationHeader header;
  Handle file;
  Layers layers;
  bool begun = false;  ///< the part is ours to remove
  bool finished = false;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (!begun || finished) return;
    // What could not be written no longer matters: the file goes.
    (void)close();
    std::error_code gone_anyway;
    std::filesystem::remove(part, gone_anyway);
  }

  [[nodiscard]] bool close() {
    const bool layers_closed = layers.value.close() & layers.variance.close() & layers.validity.close();
    return file.close() && layers_closed;
  }
};

ObservationWriter::ObservationWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
ObservationWriter::ObservationWriter(ObservationWriter&&) noexcept = default;
ObservationWriter& ObservationWriter::operator=(ObservationWriter&&) noexcept = default;
ObservationWriter::~ObservationWriter() = default;

Result<ObservationWriter> ObservationWriter::create(const std::filesystem::path& path,
                                                    const ObservationHeader& header) {
  if (auto good = check_header(header, path); !good) return base::pass(good);
  if (auto free = check_place(path); !free) return base::pass(free);
  h5::keep_quiet();
  auto state = std::make_unique<State>();
  state->path = path;
  state->part = path;
  state->part += ".part";
  state->header = header;
  std::error_code absent;
  const bool left_by_another = std::filesystem::exists(state->part, absent);
  state->file = Handle(H5Fcreate(state->part.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), &H5Fclose);
  state->begun = state->file.valid() || !left_by_another;
  if (!state->file.valid()) {
    return fail(ErrorCode::io, fmt::format("cannot create: {}", h5::last_error()), state->part.string());
  }
  const auto complete = [&]() -> Result<void> {
    if (auto done = write_header(state->file.get(), header); !done) return done;
    const auto make = [&](Handle& layer, const char* name, hid_t type, bool channels) -> Result<void> {
      auto made = make_layer(state->file.get(), header, name, type, channels);
      if (!made) return base::pass(made);
      layer = std::move(*made);
      return {};
    };
    if (auto done = make(state->layers.value, "value", H5T_IEEE_F32LE, true); !done) return done;
    if (auto done = make(state->layers.variance, "variance", H5T_IEEE_F32LE, true); !done) return done;
    return make(state->layers.validity, "validity", H5T_STD_U8LE, false);
  };
  if (auto done = complete(); !done) {
    done.error().where = state->part.string();
    return base::pass(done);
  }
  return ObservationWriter(std::move(state));
}

Result<void> ObservationWriter::write(const ObservationBlock& block) {
  const ObservationHeader& h = state_->header;
  const auto within = [](int first, int count, int all) {
    return first >= 0 && count > 0 && count <= all && first <= all - count;
  };
  const bool inside = within(block.first_row, block.rows, h.rows) &&
                      within(block.first_column, block.columns, h.columns) &&
                      static_cast<std::size_t>(block.poses) == h.poses.size();
  const std::size_t n = inside ? observations(block) : 0;
  if (!inside || block.value.size() != 3 * n || block.variance.size() != 3 * n ||
      block.validity.size() != n) {
    return fail(ErrorCode::bad_input, "a block does not fit the map", state_->path.string());
  }
  const auto put = [](const Handle& layer, hid_t type, const Selection& s, const void* data) {
    return H5Dwrite(layer.get(), type, s.memory.get(), s.file.get(), H5P_DEFAULT, data) >= 0;
  };
  const Layers& layers = state_->layers;
  const Selection rgb = select(layers.value.get(), block, -1, true);
  const Selection flags = select(layers.validity.get(), block, -1, false);
  if (!put(layers.value, H5T_NATIVE_FLOAT, rgb, block.value.data()) ||
      !put(layers.variance, H5T_NATIVE_FLOAT, rgb, block.variance.data()) ||
      !put(layers.validity, H5T_NATIVE_UINT8, flags, block.validity.data())) {
    return unwritten(state_->part);
  }
  return {};
}

Result<void> ObservationWriter::finish() {
  // Flushed while the layers are open: their caches hold tiles, and closing would hide a failure to write
  // them.
  if (H5Fflush(state_->file.get(), H5F_SCOPE_GLOBAL) < 0 || !state_->close()) return unwritten(state_->part);
  if (auto flushed = flush_to_disk(state_->part); !flushed) return flushed;
  if (auto renamed = base::rename_durably(state_->part, state_->path); !renamed) return renamed;
  state_->finished = true;
  return {};
}

}  // namespace rig::maps
