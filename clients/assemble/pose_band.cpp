#include "clients/assemble/pose_band.h"

#include <cmath>

#include "calibration/reflectance.h"
#include "core/base/parallel.h"
#include "core/scan/verify.h"

namespace rig::assemble {

namespace {

// A texel whose every channel is below this many standard deviations is dark.
constexpr float kDarkSigmas = 2;

calibration::RadianceImage merge(const Bracket& bracket, const machine::CameraConfig& camera,
                                 const calibration::PixelRect& rect) {
  return calibration::merge_exposures(bracket.exposures(), camera.intrinsics.width, camera.sensor, rect);
}

}  // namespace

std::vector<calibration::Exposure> Bracket::exposures() const {
  std::vector<calibration::Exposure> out;
  for (const scan::Frame& frame : frames) {
    out.push_back({frame.pixels.data(), frame.facts.exposure_s, frame.facts.gain});
  }
  return out;
}

base::Result<Bracket> read_bracket(const std::filesystem::path& scan, const machine::CameraConfig& camera,
                                   const scan::PoseRecord& record) {
  Bracket bracket;
  for (const scan::FrameRecord& frame_record : record.frames) {
    auto frame = scan::read_recorded_frame(scan, record.row, frame_record);
    if (!frame) return base::pass(frame);
    if (frame->width != camera.intrinsics.width || frame->height != camera.intrinsics.height) {
      return base::fail(base::ErrorCode::bad_input,
                        fmt::format("{} x {} pixels where rig.toml says {} x {}", frame->width, frame->height,
                                    camera.intrinsics.width, camera.intrinsics.height),
                        frame_record.file);
    }
    if (!(frame->facts.exposure_s > 0) || !(frame->facts.gain > 0)) {
      return base::fail(base::ErrorCode::damaged, "an exposure or gain that is not positive",
                        frame_record.file);
    }
    bracket.frames.push_back(std::move(*frame));
  }
  if (bracket.frames.empty()) return base::fail(base::ErrorCode::damaged, "the pose has no frames");
  return bracket;
}

std::vector<calibration::PatchReading> read_patches(const Bracket& bracket, const machine::RigConfig& rig,
                                                    const PoseWork& work,
                                                    std::vector<std::string>* troubles) {
  std::vector<calibration::PatchReading> readings;
  for (std::size_t i = 0; i < rig.carrier.patches.size(); ++i) {
    const machine::Patch& patch = rig.carrier.patches[i];
    const auto rect = calibration::pixels_of_patch(rig.camera.intrinsics, work.camera_from_sample, patch);
    const auto reading = calibration::measure_patch(merge(bracket, rig.camera, rect), rig.camera,
                                                    work.camera_from_sample, work.light_m, patch, i);
    if (reading) {
      readings.push_back(*reading);
    } else {
      troubles->push_back(reading.error().text());
    }
  }
  return readings;
}

void fill_pose(const Bracket& bracket, const machine::RigConfig& rig, const PoseWork& work,
               const geometry::SampleGrid& grid, int pose, maps::ObservationBlock* block) {
  const auto rect = calibration::pixels_of_rows(rig.camera.intrinsics, work.camera_from_sample, grid,
                                                block->first_row, block->rows);
  const calibration::RectifiedRows rows =
      calibration::rectify(merge(bracket, rig.camera, rect), rig.camera.intrinsics, rig.camera.bayer,
                           work.camera_from_sample, grid, block->first_row, block->rows);
  std::size_t texel = 0;
  for (int t = 0; t < block->rows; ++t) {
    for (int s = 0; s < block->columns; ++s, ++texel) {
      if (rows.state[texel] == calibration::TexelState::missing) continue;
      const double irradiance =
          calibration::irradiance_per_intensity(work.light_m, grid.centre(s, block->first_row + t));
      if (irradiance <= 0) continue;
      const std::size_t observation = block->texel_index(t, s) + static_cast<std::size_t>(pose);
      const auto factor = static_cast<float>(1 / irradiance);
      for (std::size_t c = 0; c < 3; ++c) {
        block->value[3 * observation + c] = factor * rows.value[3 * texel + c];
        block->variance[3 * observation + c] = factor * factor * rows.variance[3 * texel + c];
      }
      block->validity[observation] = rows.state[texel] == calibration::TexelState::saturated
                                         ? maps::Validity::saturated
                                         : maps::Validity::good;
    }
  }
}

void apply_scale(std::span<const calibration::Rgb> intensity, maps::ObservationBlock* block) {
  std::vector<float> factor;
  for (const calibration::Rgb& rgb : intensity) {
    for (const double value : rgb) factor.push_back(static_cast<float>(1 / value));
  }
  const std::size_t row_values = block->texel_index(1, 0);
  base::parallel_for(static_cast<std::size_t>(block->rows), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * row_values; i < end * row_values; ++i) {
      const std::size_t pose = i % intensity.size();
      bool dark = true;
      for (std::size_t c = 0; c < 3; ++c) {
        const float k = factor[3 * pose + c];
        block->value[3 * i + c] *= k;
        block->variance[3 * i + c] *= k * k;
        dark = dark && block->value[3 * i + c] < kDarkSigmas * std::sqrt(block->variance[3 * i + c]);
      }
      if (dark && block->validity[i] == maps::Validity::good) block->validity[i] = maps::Validity::dark;
    }
  });
}

}  // namespace rig::assemble
