// A scan on disk of the small rig (synthetic.h), rendered once a process, for tests of what reads scans.
#pragma once

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

#include "core/machine/job_config.h"
#include "core/machine/kinematics.h"
#include "core/scan/scan_directory.h"
#include "tests/calibration/synthetic.h"

namespace rig::testing {

namespace fs = std::filesystem;

inline constexpr std::uint64_t kScanSeed = 4711;
inline constexpr Rgb kScanIntensity{60e3, 96e3, 69e3};

// small_rig() in words.
inline std::string small_rig_toml() {
  const machine::RigConfig rig = small_rig();
  std::string out = R"(format = 1
name = "small"
clock = "system"
[[module]]
name = "m"
file = "m"
[module.settings]
)";
  const std::array<std::string, 4> ranges{"-180.0, 180.0", "-75.0, 75.0", "-90.0, 90.0", "10.0, 175.0"};
  for (std::size_t i = 0; i < machine::kAxisCount; ++i) {
    const auto comma = ranges[i].find(',');
    out += fmt::format(
        "[axis.{0}]\nmodule = \"m\"\ndevice = \"{0}\"\nmin_deg = {1}\nmax_deg = {2}\nmax_velocity_deg_s = "
        "60.0\n"
        "max_acceleration_deg_s2 = 100.0\njog_velocity_deg_s = 5.0\ntolerance_deg = 0.02\nsettle_ms = 300\n"
        "approach_deg = 2.0\nhome_deg = {3}\n",
        machine::kAxisNames[i], ranges[i].substr(0, comma), ranges[i].substr(comma + 2), i == 3 ? 45.0 : 0.0);
  }
  out += R"([home]
order = ["arm", "tilt", "pan", "roll"]
[camera]
module = "m"
device = "camera"
width = 640
height = 480
fx_px = 6000.0
fy_px = 6000.0
cx_px = 321.3
cy_px = 237.8
k1 = -0.12
k2 = 0.05
p1 = 0.0004
p2 = -0.0003
k3 = 0.0
bayer = "RGGB"
bits = 12
black_dn = 64.0
saturation_dn = 4095.0
electrons_per_dn = 8.0
read_noise_e = 6.0
white_balance = [1.6, 1.0, 1.4]
min_exposure_us = 10
max_exposure_us = 10000000
position_mm = [0.0, 0.0, 1225.4]
[light]
module = "m"
device = "light"
arm_radius_mm = 1000.0
aperture_mm = 20.0
warm_up_s = 900
[carrier]
plane_offset_mm = 25.4
sample_width_mm = 40.0
sample_height_mm = 40.0
tag_family = "tag36h11"
fiducials = [
)";
  for (const auto& tag : rig.carrier.fiducials) {
    out += fmt::format("  [{}, {:.1f}, {:.1f}, 12.0, 0.0],\n", tag.id, tag.x_m * 1e3, tag.y_m * 1e3);
  }
  out += "]\n";
  for (const auto& patch : rig.carrier.patches) {
    out += fmt::format(
        "[[carrier.patch]]\nx_mm = {:.1f}\ny_mm = {:.1f}\nwidth_mm = 10.0\nheight_mm = 10.0\nreflectance = "
        "0.5\n",
        patch.x_m * 1e3, patch.y_m * 1e3);
  }
  return out + "[bodies]\nlight_radius_mm = 60.0\ncamera_radius_mm = 90.0\ncarrier_radius_mm = 80.0\n";
}

// Smooth in one half, with a highlight far brighter than white: saturated in the longest exposures.
inline Rgb scan_albedo(double x, double y) {
  if (x > 0.012 && y > 0.012) return {30, 30, 30};
  const double wave = 0.5 + 0.3 * std::sin(100 * x) * std::cos(80 * y);
  return {0.8 * wave, 0.5 * (1 - wave) + 0.1, 0.3 + 5 * x};
}

// One scan for all tests: three good poses, one whose tags are hidden, one with a damaged frame.
class SyntheticScan {
 public:
  SyntheticScan() : folder_(fs::temp_directory_path() / fmt::format("rig-scan-test-{}", ::getpid())) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    job_.name = "test";
    job_.sample = "waves";
    job_.exposure.exposures_s = {0.4, 0.1, 0.02};
    for (const auto& [roll, tilt, pan, arm] :
         {std::array{0.0, 0.0, 0.0, 35.0}, std::array{100.0, 30.0, -15.0, 40.0},
          std::array{-70.0, -50.0, 20.0, 30.0}, std::array{20.0, 10.0, 5.0, 60.0},
          std::array{45.0, 5.0, -5.0, 50.0}}) {
      job_.poses.push_back(
          {base::radians(roll), base::radians(tilt), base::radians(pan), base::radians(arm)});
    }
    make();
  }
  SyntheticScan(const SyntheticScan&) = delete;
  SyntheticScan& operator=(const SyntheticScan&) = delete;
  ~SyntheticScan() { fs::remove_all(folder_); }

  static SyntheticScan& shared() {
    static SyntheticScan scan;
    return scan;
  }
  [[nodiscard]] fs::path path() const { return folder_ / "scan"; }
  [[nodiscard]] fs::path file(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  template <typename T>
  bool good(const base::Result<T>& result) {
    if (!result && trouble_.empty()) trouble_ = result.error().text();
    return static_cast<bool>(result);
  }

  void make() {
    const std::string toml = small_rig_toml();
    if (!good(scan::create_scan(path(), toml, machine::format_job_config(job_, "")))) return;
    const auto rig = machine::parse_rig_config(toml, "rig.toml");
    if (!good(rig)) return;
    auto journal = scan::Journal::open(scan::journal_path(path()));
    if (!good(journal)) return;
    const Carrier carrier(*rig, &scan_albedo);
    for (std::size_t row = 0; row < job_.poses.size(); ++row) take(*rig, carrier, *journal, row);
    // Rot in the middle of a frame of the last pose.
    std::fstream frame(scan::frames_folder(path(), 4) / scan::frame_name(1), std::ios::in | std::ios::out);
    frame.seekp(0);
    frame << "no TIFF";
  }

  // The carrier stands a little off where the motors say.
  void take(const machine::RigConfig& rig, const Carrier& carrier, scan::Journal& journal, std::size_t row) {
    const machine::JointAngles& angles = job_.poses[row];
    machine::JointAngles real = angles;
    base::Random random(base::derive_key(kScanSeed, row));
    for (std::size_t i = 0; i < 3; ++i) real[i] += base::radians(random.uniform(-0.4, 0.4));
    const auto camera_from_sample =
        rig.camera.camera_from_bench * machine::bench_from_sample(rig.carrier, real);
    const geometry::Vec3 light =
        geometry::inverse(camera_from_sample)
            .point(rig.camera.camera_from_bench.point(machine::light_in_bench(rig.light, angles)));
    auto signal = render(rig, carrier, camera_from_sample, light, kScanIntensity);
    if (row == 3) std::fill(signal.begin(), signal.end(), 100.0);
    scan::PoseRecord record;
    record.row = static_cast<std::int64_t>(row);
    record.target_rad = record.readback_rad = angles;
    for (std::size_t k = 0; k < job_.exposure.exposures_s.size(); ++k) {
      scan::FrameFacts facts;
      facts.row = record.row;
      facts.index = static_cast<int>(k);
      facts.target_rad = facts.readback_rad = angles;
      facts.exposure_s = job_.exposure.exposures_s[k];
      facts.bayer = "RGGB";
      facts.bits = 12;
      const auto samples = expose(rig, signal, facts.exposure_s, base::derive_key(kScanSeed + k, row));
      const auto& camera = rig.camera.intrinsics;
      const auto hash = scan::store_frame(path(), facts, camera.width, camera.height, samples.data());
      if (!good(hash)) return;
      scan::FrameRecord frame;
      frame.index = facts.index;
      frame.file =
          fs::relative(scan::frames_folder(path(), record.row), path()) / scan::frame_name(facts.index);
      frame.exposure_s = facts.exposure_s;
      frame.sha256 = *hash;
      record.frames.push_back(frame);
    }
    if (!good(scan::publish_bracket(path(), record.row))) return;
    good(journal.commit_pose(record, {}));
  }

  fs::path folder_;
  machine::JobConfig job_;
  std::string trouble_;
};

}  // namespace rig::testing
