#include "clients/import/import.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "core/base/interrupt.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/geometry/sample_grid.h"
#include "core/maps/observation_map.h"

namespace rig::import {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using geometry::Vec3;
using maps::Validity;

namespace {

// Cosine of the incident angle below which nothing can be measured.
constexpr double kLowestCosine = 0.02;
// A value and a variance a channel, and the validity.
constexpr std::size_t kObservationBytes = 25;

Result<ImageSize> common_size(const Stack& stack) {
  std::optional<ImageSize> common;
  for (const Photograph& photograph : stack.photographs) {
    const auto size = image_size(photograph.file);
    if (!size) return size;
    if (common && (size->width != common->width || size->height != common->height)) {
      return fail(ErrorCode::bad_input,
                  fmt::format("is {} x {} pixels, the first image {} x {}", size->width, size->height,
                              common->width, common->height),
                  photograph.file.string(), "rectify all photographs to one size");
    }
    common = *size;
  }
  return *common;
}

// Irradiance of unit power on the sample at a point; not positive where the light does not reach.
double irradiance(const std::array<double, 4>& light_m, Vec3 point) {
  const Vec3 to_light = Vec3{light_m[0], light_m[1], light_m[2]} - light_m[3] * point;
  const double squared = dot(to_light, to_light);
  const double cosine = to_light.z / std::sqrt(squared);
  if (cosine < kLowestCosine) return 0;
  return light_m[3] > 0 ? cosine / squared : cosine;
}

// The values of one photograph into its pose of the block.
void fill_pose(const TexelImage& image, const Stack& stack, std::size_t pose,
               const geometry::SampleGrid& grid, double photograph_noise, maps::ObservationBlock& block) {
  const auto texels = image.validity.size();
  for (std::size_t i = 0; i < texels; ++i) {
    const int t = static_cast<int>(i) / grid.columns;
    const int s = static_cast<int>(i) % grid.columns;
    const double e = irradiance(stack.photographs[pose].light_m, grid.centre(s, block.first_row + t));
    if (!(e > 0)) continue;
    const std::size_t at = block.texel_index(t, s) + pose;
    block.validity[at] = image.validity[i];
    for (std::size_t c = 0; c < 3; ++c) {
      const double scale = 1 / (e * stack.light_power[c]);
      const double value = static_cast<double>(image.value[3 * i + c]) * scale;
      const double noise = photograph_noise * value;
      block.value[3 * at + c] = static_cast<float>(value);
      block.variance[3 * at + c] =
          static_cast<float>(static_cast<double>(image.variance[3 * i + c]) * scale * scale + noise * noise);
    }
  }
}

maps::ObservationHeader make_header(const Stack& stack, const ImportOptions& options,
                                    const geometry::SampleGrid& grid) {
  maps::ObservationHeader header;
  header.columns = grid.columns;
  header.rows = grid.rows;
  header.width_m = grid.width_m;
  header.height_m = grid.height_m;
  header.quantity = maps::Quantity::brdf;
  header.name = options.name;
  header.provenance["program"] = "rig-import";
  header.provenance["command"] = options.command;
  header.provenance["layout"] = stack.layout;
  header.provenance["encoding"] = text_of(options.encoding) + ", as given, not measured";
  header.provenance["variance"] =
      fmt::format("rounding to whole codes, and {} of the value, as given", options.photograph_noise);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < stack.photographs.size(); ++i) {
    maps::PoseGeometry pose;
    pose.row = static_cast<std::int64_t>(i);
    pose.camera_m = stack.photographs[i].camera_m;
    pose.light_m = stack.photographs[i].light_m;
    pose.target_rad.fill(kNan);
    pose.camera_from_sample.fill(kNan);
    pose.registration_rms_px = kNan;
    header.poses.push_back(pose);
  }
  return header;
}

// The first error of many threads.
class FirstError {
 public:
  void set(const base::Error& error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = error;
    is_set_ = true;
  }
  [[nodiscard]] bool is_set() const { return is_set_; }
  /// Once the threads have ended.
  [[nodiscard]] const base::Error& get() const { return *error_; }

 private:
  std::mutex mutex_;
  std::optional<base::Error> error_;
  std::atomic<bool> is_set_{false};
};

}  // namespace

std::string ImportSummary::text() const {
  return fmt::format("{} x {} texels, {} photographs; {:.2f} % of the values saturated, {:.2f} % dark\n",
                     columns, rows, photographs, 100 * saturated_share, 100 * dark_share);
}

Result<ImportSummary> import_stack(const Stack& stack, const ImportOptions& options) {
  if (!(stack.width_m > 0)) {
    return fail(ErrorCode::bad_input, "the layout does not say how wide the sample is", {},
                "give --width-mm");
  }
  const auto size = common_size(stack);
  if (!size) return pass(size);
  geometry::SampleGrid grid;
  grid.columns = options.columns > 0 ? options.columns : size->width;
  if (grid.columns > size->width) {
    return fail(
        ErrorCode::bad_input,
        fmt::format("{} texels are more than the {} pixels of the photographs", grid.columns, size->width),
        "--texels");
  }
  grid.rows = std::max(
      1, static_cast<int>(std::lround(static_cast<double>(grid.columns) * size->height / size->width)));
  grid.width_m = stack.width_m;
  grid.height_m = stack.width_m * size->height / size->width;

  const std::size_t poses = stack.photographs.size();
  const std::size_t tile_row =
      static_cast<std::size_t>(grid.columns) * maps::kTile * poses * kObservationBytes;
  const std::size_t tile_rows = std::max<std::size_t>(1, (options.memory_mib << 20) / tile_row);
  const int band = static_cast<int>(
      std::min(tile_rows * static_cast<std::size_t>(maps::kTile), static_cast<std::size_t>(grid.rows)));
  const int bands = (grid.rows + band - 1) / band;

  auto writer = maps::ObservationWriter::create(options.out, make_header(stack, options, grid));
  if (!writer) return pass(writer);
  base::Progress progress("import", poses * static_cast<std::size_t>(bands),
                          bands == 1 ? "photographs" : "photographs of all bands");
  std::atomic<std::size_t> saturated{0};
  std::atomic<std::size_t> dark{0};
  for (int first = 0; first < grid.rows; first += band) {
    maps::ObservationBlock block;
    block.first_row = first;
    block.rows = std::min(band, grid.rows - first);
    block.columns = grid.columns;
    block.poses = static_cast<int>(poses);
    block.allocate();
    FirstError trouble;
    base::parallel_for(poses, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end && !trouble.is_set() && !base::interrupted(); ++p) {
        const auto image = read_texels(stack.photographs[p].file, options.encoding, grid.columns, grid.rows,
                                       first, block.rows);
        if (!image) {
          trouble.set(image.error());
          return;
        }
        fill_pose(*image, stack, p, grid, options.photograph_noise, block);
        saturated += static_cast<std::size_t>(
            std::count(image->validity.begin(), image->validity.end(), Validity::saturated));
        dark += static_cast<std::size_t>(
            std::count(image->validity.begin(), image->validity.end(), Validity::dark));
        progress.add();
      }
    });
    if (trouble.is_set()) return tl::unexpected(trouble.get());
    if (base::interrupted()) return base::interrupted_error("no map was written");
    if (auto written = writer->write(block); !written) return pass(written);
  }
  if (auto done = writer->finish(); !done) return pass(done);
  const double all = static_cast<double>(grid.columns) * grid.rows * static_cast<double>(poses);
  return ImportSummary{poses, grid.columns, grid.rows, static_cast<double>(saturated) / all,
                       static_cast<double>(dark) / all};
}

}  // namespace rig::import
