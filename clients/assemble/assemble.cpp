#include "clients/assemble/assemble.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "calibration/reflectance.h"
#include "calibration/registration_file.h"
#include "clients/assemble/pose_band.h"
#include "core/base/interrupt.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/scan/scan_directory.h"

namespace rig::assemble {

namespace {

using calibration::PoseRegistration;

constexpr std::size_t kMib = std::size_t{1} << 20;
// A value and a variance a channel, and the validity.
constexpr std::size_t kObservationBytes = 25;

// The poses to assemble, and those left out with the reason.
std::vector<PoseWork> choose_poses(const scan::ScanView& view, const calibration::RegistrationFile& file,
                                   std::vector<const PoseRegistration*>* registrations,
                                   AssembleSummary* summary) {
  std::map<std::int64_t, const PoseRegistration*> by_row;
  for (const PoseRegistration& pose : file.poses) by_row[pose.row] = &pose;
  std::vector<PoseWork> works;
  for (const scan::PoseRecord& record : view.poses) {
    const auto found = by_row.find(record.row);
    if (found == by_row.end()) {
      summary->left_out.push_back({record.row, "taken after the registration; run 'rig calibrate' again"});
    } else if (!found->second->registered) {
      summary->left_out.push_back({record.row, found->second->reason});
    } else {
      const auto& camera_from_sample = found->second->camera_from_sample;
      works.push_back({&record, camera_from_sample,
                       calibration::light_in_sample(view.rig, camera_from_sample, record.readback_rad)});
      registrations->push_back(found->second);
    }
  }
  return works;
}

maps::PoseGeometry geometry_of(const PoseWork& work, const PoseRegistration& registration) {
  maps::PoseGeometry out;
  const auto& r = work.camera_from_sample.rotation.m;
  const auto& t = work.camera_from_sample.translation;
  const geometry::Vec3 camera = geometry::inverse(work.camera_from_sample).translation;
  out.row = work.record->row;
  out.camera_m = {camera.x, camera.y, camera.z};
  out.light_m = {work.light_m.x, work.light_m.y, work.light_m.z, 1};
  std::copy(work.record->target_rad.begin(), work.record->target_rad.end(), out.target_rad.begin());
  out.camera_from_sample = {r[0], r[1], r[2], t.x, r[3], r[4], r[5], t.y, r[6], r[7], r[8], t.z};
  out.registration_rms_px = registration.rms_px;
  return out;
}

// Tile rows that fit into the memory together with the poses in flight; an error where not even one does.
base::Result<int> rows_per_band(const AssembleOptions& options, const scan::ScanView& view,
                                const geometry::SampleGrid& grid, std::size_t poses) {
  const std::size_t threads = std::max(1U, std::thread::hardware_concurrency());
  const auto& camera = view.rig.camera.intrinsics;
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  std::size_t frames = 1;
  for (const scan::PoseRecord& record : view.poses) frames = std::max(frames, record.frames.size());
  // Raw samples, then the merged image: value, variance, flag.
  const std::size_t in_flight = threads * pixels * (2 * frames + 9);
  const std::size_t row = static_cast<std::size_t>(grid.columns) * kObservationBytes * (poses + threads);
  const std::size_t given = options.memory_mib * kMib;
  const std::size_t least = in_flight + row * static_cast<std::size_t>(std::min(maps::kTile, grid.rows));
  if (given < least) {
    return base::fail(
        base::ErrorCode::bad_input,
        fmt::format("{} MiB are too few for {} poses on {} cores", options.memory_mib, poses, threads), {},
        fmt::format("give at least --memory-mib {}", least / kMib + 1));
  }
  const std::size_t tile_rows = (given - in_flight) / (row * maps::kTile);
  const std::size_t rows = std::max<std::size_t>(tile_rows, 1) * maps::kTile;
  return static_cast<int>(std::min(rows, static_cast<std::size_t>(grid.rows)));
}

// The job of one call.
class Assembly {
 public:
  Assembly(const AssembleOptions& options, const scan::ScanView& view, std::vector<PoseWork> works,
           std::vector<const PoseRegistration*> registrations, geometry::SampleGrid grid,
           AssembleSummary* summary)
      : options_(options),
        view_(view),
        works_(std::move(works)),
        registrations_(std::move(registrations)),
        grid_(grid),
        summary_(summary),
        readings_(works_.size()),
        troubles_(works_.size()),
        damage_(works_.size()) {}

  base::Result<void> run(int band_rows) {
    summary_->bands = (grid_.rows + band_rows - 1) / band_rows;
    base::Progress progress("assembly", works_.size() * static_cast<std::size_t>(summary_->bands),
                            summary_->bands == 1 ? "poses" : "poses of all bands");
    std::optional<maps::ObservationWriter> writer;
    for (int first = 0; first < grid_.rows; first += band_rows) {
      maps::ObservationBlock block;
      block.first_row = first;
      block.rows = std::min(band_rows, grid_.rows - first);
      block.columns = grid_.columns;
      block.poses = static_cast<int>(works_.size());
      block.allocate();
      fill(&block, first == 0, &progress);
      if (base::interrupted()) {
        return base::interrupted_error("no map was written; the scan and its registration are as they were");
      }
      if (first == 0) scale_light();
      apply_scale(intensity_, &block);
      if (!writer) {
        auto made = maps::ObservationWriter::create(options_.out, header());
        if (!made) return base::pass(made);
        writer = std::move(*made);
      }
      if (auto written = writer->write(block); !written) return written;
    }
    return writer->finish();
  }

 private:
  void fill(maps::ObservationBlock* block, bool with_patches, base::Progress* progress) {
    base::parallel_for(works_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end && !base::interrupted(); ++i) {
        const auto bracket = read_bracket(options_.scan, view_.rig.camera, *works_[i].record);
        if (!bracket) {
          damage_[i] = bracket.error().text();
        } else {
          if (with_patches) readings_[i] = read_patches(*bracket, view_.rig, works_[i], &troubles_[i]);
          fill_pose(*bracket, view_.rig, works_[i], grid_, static_cast<int>(i), block);
        }
        progress->add();
      }
    });
  }

  void scale_light() {
    const auto scale = calibration::pool_readings(readings_);
    for (std::size_t i = 0; i < works_.size(); ++i) {
      if (!damage_[i].empty()) note(i, "all texels missing: " + damage_[i]);
      for (const std::string& trouble : troubles_[i]) note(i, trouble);
    }
    if (!scale) {
      intensity_.assign(works_.size(), {1, 1, 1});
      return;
    }
    summary_->absolute = true;
    intensity_ = scale->intensity;
    mean_intensity_ = scale->mean;
    for (std::size_t c = 0; c < 3; ++c) {
      summary_->light_between_poses = std::max(summary_->light_between_poses, scale->between_poses[c]);
      summary_->light_between_patches = std::max(summary_->light_between_patches, scale->between_patches[c]);
    }
    for (const calibration::Disagreement& odd : scale->disagreements) {
      if (odd.patch < 0) {
        note(odd.pose,
             fmt::format("its patches say the light was {:+.1f} % off the mean", 100 * odd.relative));
      } else {
        note(odd.pose, fmt::format("patch {} is {:+.1f} % off the pose's other patches and not used",
                                   odd.patch + 1, 100 * odd.relative));
      }
    }
  }

  void note(std::size_t pose, std::string text) {
    summary_->notes.push_back({works_[pose].record->row, std::move(text)});
  }

  [[nodiscard]] maps::ObservationHeader header() const {
    maps::ObservationHeader out;
    out.columns = grid_.columns;
    out.rows = grid_.rows;
    out.width_m = grid_.width_m;
    out.height_m = grid_.height_m;
    out.quantity = maps::Quantity::brdf;
    out.absolute = summary_->absolute;
    out.name = view_.job.sample;
    out.provenance["program"] = "rig-assemble";
    out.provenance["command"] = options_.command;
    out.provenance["rig"] = view_.rig.name;
    out.provenance["job"] = view_.job.name;
    out.provenance["scan"] = std::filesystem::weakly_canonical(options_.scan).filename().string();
    out.provenance["colour"] = "camera RGB, neutral where the reference patches are";
    out.provenance["light.intensity_dn_m2_per_s"] =
        fmt::format("{:.6g} {:.6g} {:.6g}", mean_intensity_[0], mean_intensity_[1], mean_intensity_[2]);
    out.provenance["light.relative_sigma_between_poses"] =
        fmt::format("{:.4g}", summary_->light_between_poses);
    out.provenance["light.relative_sigma_between_patches"] =
        fmt::format("{:.4g}", summary_->light_between_patches);
    for (std::size_t i = 0; i < works_.size(); ++i) {
      out.poses.push_back(geometry_of(works_[i], *registrations_[i]));
    }
    return out;
  }

  const AssembleOptions& options_;
  const scan::ScanView& view_;
  std::vector<PoseWork> works_;
  std::vector<const PoseRegistration*> registrations_;
  geometry::SampleGrid grid_;
  AssembleSummary* summary_;
  std::vector<std::vector<calibration::PatchReading>> readings_;
  std::vector<std::vector<std::string>> troubles_;
  std::vector<std::string> damage_;
  std::vector<calibration::Rgb> intensity_;
  calibration::Rgb mean_intensity_{1, 1, 1};
};

}  // namespace

std::string AssembleSummary::text() const {
  std::string out = fmt::format("{} x {} texels, {} poses", columns, rows, poses);
  if (bands > 1) out += fmt::format(", {} bands", bands);
  out += '\n';
  if (absolute) {
    out +=
        fmt::format("reference patches: light varies by {:.2f} % between poses, {:.2f} % between patches\n",
                    100 * light_between_poses, 100 * light_between_patches);
  } else {
    out += "no pose shows a reference patch: reflectance is relative, up to one factor a colour\n";
  }
  for (const PoseNote& note : left_out) out += fmt::format("row {} left out: {}\n", note.row, note.text);
  for (const PoseNote& note : notes) out += fmt::format("row {}: {}\n", note.row, note.text);
  return out;
}

base::Result<AssembleSummary> assemble_scan(const AssembleOptions& options) {
  auto view = scan::open_scan(options.scan);
  if (!view) return base::pass(view);
  auto registration = calibration::read_registration(options.scan);
  if (!registration) return base::pass(registration);

  AssembleSummary summary;
  std::vector<const PoseRegistration*> registrations;
  std::vector<PoseWork> works = choose_poses(*view, *registration, &registrations, &summary);
  if (works.empty()) {
    return base::fail(base::ErrorCode::bad_input, "no pose of the scan is registered",
                      calibration::registration_path(options.scan).string(),
                      "the file gives the reason for each; mend that and run 'rig calibrate' again");
  }
  const machine::CarrierConfig& carrier = view->rig.carrier;
  geometry::SampleGrid grid;
  grid.columns = options.columns;
  grid.rows = std::max(
      1, static_cast<int>(std::lround(options.columns * carrier.sample_height_m / carrier.sample_width_m)));
  grid.width_m = carrier.sample_width_m;
  grid.height_m = carrier.sample_height_m;
  summary.columns = grid.columns;
  summary.rows = grid.rows;
  summary.poses = works.size();
  const auto band_rows = rows_per_band(options, *view, grid, works.size());
  if (!band_rows) return base::pass(band_rows);

  Assembly assembly(options, *view, std::move(works), std::move(registrations), grid, &summary);
  if (auto done = assembly.run(*band_rows); !done) return base::pass(done);
  return summary;
}

}  // namespace rig::assemble
