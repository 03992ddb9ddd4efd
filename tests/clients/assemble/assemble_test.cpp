// From frames to an observation map, through rig-calibrate's library and rig-assemble's, on a scan that the
// test renders itself.
#include "clients/assemble/assemble.h"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "calibration/registration_file.h"
#include "calibration/scan_registration.h"
#include "core/base/files.h"
#include "core/base/hash.h"
#include "core/geometry/sample_grid.h"
#include "core/machine/kinematics.h"
#include "core/maps/observation_map.h"
#include "core/scan/scan_directory.h"
#include "tests/calibration/synthetic.h"

namespace rig::assemble {
namespace {

using geometry::Vec3;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr std::uint64_t kSeed = 4711;
constexpr testing::Rgb kIntensity{60e3, 96e3, 69e3};

// testing::small_rig() in words.
std::string rig_toml() {
  const machine::RigConfig rig = testing::small_rig();
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
testing::Rgb albedo(double x, double y) {
  if (x > 0.012 && y > 0.012) return {30, 30, 30};
  const double wave = 0.5 + 0.3 * std::sin(100 * x) * std::cos(80 * y);
  return {0.8 * wave, 0.5 * (1 - wave) + 0.1, 0.3 + 5 * x};
}

// One scan for all tests: three good poses, one whose tags are hidden, one with a damaged frame.
class Scan {
 public:
  Scan() : folder_(fs::temp_directory_path() / fmt::format("rig-assemble-test-{}", ::getpid())) {
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
  Scan(const Scan&) = delete;
  Scan& operator=(const Scan&) = delete;
  ~Scan() { fs::remove_all(folder_); }

  static Scan& shared() {
    static Scan scan;
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
    const std::string toml = rig_toml();
    if (!good(scan::create_scan(path(), toml, machine::format_job_config(job_, "")))) return;
    const auto rig = machine::parse_rig_config(toml, "rig.toml");
    if (!good(rig)) return;
    auto journal = scan::Journal::open(scan::journal_path(path()));
    if (!good(journal)) return;
    const testing::Carrier carrier(*rig, &albedo);
    for (std::size_t row = 0; row < job_.poses.size(); ++row) take(*rig, carrier, *journal, row);
    // Rot in the middle of a frame of the last pose.
    std::fstream frame(scan::frames_folder(path(), 4) / scan::frame_name(1), std::ios::in | std::ios::out);
    frame.seekp(0);
    frame << "no TIFF";
  }

  // The carrier stands a little off where the motors say.
  void take(const machine::RigConfig& rig, const testing::Carrier& carrier, scan::Journal& journal,
            std::size_t row) {
    const machine::JointAngles& angles = job_.poses[row];
    machine::JointAngles real = angles;
    base::Random random(base::derive_key(kSeed, row));
    for (std::size_t i = 0; i < 3; ++i) real[i] += base::radians(random.uniform(-0.4, 0.4));
    const auto camera_from_sample =
        rig.camera.camera_from_bench * machine::bench_from_sample(rig.carrier, real);
    const Vec3 light =
        geometry::inverse(camera_from_sample)
            .point(rig.camera.camera_from_bench.point(machine::light_in_bench(rig.light, angles)));
    auto signal = testing::render(rig, carrier, camera_from_sample, light, kIntensity);
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
      const auto samples = testing::expose(rig, signal, facts.exposure_s, base::derive_key(kSeed + k, row));
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

class Assemble : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(scan_.trouble(), "");
    auto view = scan::open_scan(scan_.path());
    ASSERT_TRUE(view) << view.error().text();
    auto finder = calibration::TagFinder::create("tag36h11");
    ASSERT_TRUE(finder);
    registration_.rig_sha256 = *base::sha256_of_file(scan_.path() / "rig.toml");
    for (const auto& pose : view->poses) {
      registration_.poses.push_back(calibration::register_pose(scan_.path(), view->rig, pose, *finder));
    }
    ASSERT_TRUE(calibration::write_registration(scan_.path(), registration_));
  }

  [[nodiscard]] AssembleOptions options(const std::string& name) const {
    AssembleOptions out;
    out.scan = scan_.path();
    out.out = scan_.file(name);
    out.columns = 64;
    out.command = "test";
    return out;
  }

  Scan& scan_ = Scan::shared();
  calibration::RegistrationFile registration_;
};

TEST_F(Assemble, RegistersWhatCanBeAndSaysWhyNot) {
  ASSERT_EQ(registration_.poses.size(), 5U);
  for (const std::size_t i : {0U, 1U, 2U}) {
    EXPECT_TRUE(registration_.poses[i].registered) << registration_.poses[i].reason;
    EXPECT_LT(registration_.poses[i].expected_error_m, 0.01e-3);
    // The highlight and the white of the tags saturate the longest exposure of some poses.
    EXPECT_GE(registration_.poses[i].frame, 0);
  }
  EXPECT_FALSE(registration_.poses[3].registered);
  EXPECT_THAT(registration_.poses[3].reason, HasSubstr("0 of the carrier's 12 tags"));
  // Its fiducials are in another frame than the damaged one.
  EXPECT_TRUE(registration_.poses[4].registered) << registration_.poses[4].reason;
}

TEST_F(Assemble, ReflectanceIsThatOfTheSample) {
  const auto summary = assemble_scan(options("map.h5"));
  ASSERT_TRUE(summary) << summary.error().text();
  EXPECT_EQ(summary->poses, 4U);
  EXPECT_TRUE(summary->absolute);
  ASSERT_EQ(summary->left_out.size(), 1U);
  EXPECT_EQ(summary->left_out[0].row, 3);
  ASSERT_EQ(summary->notes.size(), 1U) << summary->text();
  EXPECT_EQ(summary->notes[0].row, 4);
  EXPECT_THAT(summary->notes[0].text, HasSubstr("01.tif"));

  auto reader = maps::ObservationReader::open(scan_.file("map.h5"));
  ASSERT_TRUE(reader) << reader.error().text();
  const auto& header = reader->header();
  EXPECT_EQ(header.name, "waves");
  EXPECT_TRUE(header.absolute);
  ASSERT_EQ(header.poses.size(), 4U);
  EXPECT_EQ(header.poses[3].row, 4);
  const geometry::SampleGrid grid{64, 64, 0.04, 0.04};
  for (int pose = 0; pose < 3; ++pose) {
    const auto& pose_geometry = header.poses[static_cast<std::size_t>(pose)];
    EXPECT_NEAR(std::hypot(pose_geometry.camera_m[0], pose_geometry.camera_m[1], pose_geometry.camera_m[2]),
                1.2, 0.02);
    EXPECT_EQ(pose_geometry.light_m[3], 1);
    EXPECT_GT(pose_geometry.light_m[2], 0);
    const auto block = reader->read_pose(pose);
    ASSERT_TRUE(block);
    std::vector<double> errors;
    double chi2 = 0;
    for (int t = 0; t < 64; ++t) {
      for (int s = 0; s < 64; ++s) {
        const Vec3 p = grid.centre(s, t);
        // Not beside an edge, which the interpolation blurs by up to two pixels.
        if ((p.x > 0.011 && p.y > 0.011) || std::max(std::abs(p.x), std::abs(p.y)) > 0.019) continue;
        // The block holds this pose alone.
        const std::size_t i = block->texel_index(t, s);
        ASSERT_EQ(block->validity[i], maps::Validity::good) << s << ", " << t;
        const testing::Rgb truth = albedo(p.x, p.y);
        for (std::size_t c = 0; c < 3; ++c) {
          const double f = static_cast<double>(block->value[3 * i + c]);
          errors.push_back(std::abs(f * base::kPi / truth[c] - 1));
          const double d = f - truth[c] / base::kPi;
          chi2 += d * d / static_cast<double>(block->variance[3 * i + c]);
        }
      }
    }
    std::sort(errors.begin(), errors.end());
    const double median = errors[errors.size() / 2], high = errors[errors.size() * 95 / 100];
    chi2 /= static_cast<double>(errors.size());
    std::cout << "pose " << pose << ": median error " << 100 * median << " %, 95 % below " << 100 * high
              << " %, squared error over variance " << chi2 << '\n';
    EXPECT_LT(median, 0.01);
    EXPECT_LT(high, 0.03);
    // The variance in the map is that of the values.
    EXPECT_GT(chi2, 0.9);
    EXPECT_LT(chi2, 1.15);
  }
  // The damaged pose has no value anywhere.
  const auto damaged = reader->read_pose(3);
  ASSERT_TRUE(damaged);
  EXPECT_EQ(std::count(damaged->validity.begin(), damaged->validity.end(), maps::Validity::missing), 64 * 64);
}

TEST_F(Assemble, SaturatedTexelsAreLowerBounds) {
  ASSERT_TRUE(assemble_scan(options("bounds.h5")));
  auto reader = maps::ObservationReader::open(scan_.file("bounds.h5"));
  ASSERT_TRUE(reader);
  const auto block = reader->read_pose(0);
  ASSERT_TRUE(block);
  const geometry::SampleGrid grid{64, 64, 0.04, 0.04};
  int saturated = 0;
  for (int t = 0; t < 64; ++t) {
    for (int s = 0; s < 64; ++s) {
      const Vec3 p = grid.centre(s, t);
      if (p.x < 0.0135 || p.y < 0.0135) continue;
      const std::size_t i = block->texel_index(t, s);
      EXPECT_EQ(block->validity[i], maps::Validity::saturated);
      EXPECT_LT(static_cast<double>(block->value[3 * i + 1]), 30 / base::kPi);
      EXPECT_GT(static_cast<double>(block->value[3 * i + 1]), 0.5);
      ++saturated;
    }
  }
  EXPECT_GT(saturated, 50);
}

TEST_F(Assemble, BandsGiveTheSameMap) {
  const auto one = assemble_scan(options("one.h5"));
  ASSERT_TRUE(one) << one.error().text();
  EXPECT_EQ(one->bands, 1);
  // The least that the error asks for gives a band a tile row.
  AssembleOptions narrow = options("bands.h5");
  narrow.columns = 512;
  narrow.memory_mib = 1;
  const auto refused = assemble_scan(narrow);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text(), HasSubstr("--memory-mib"));
  EXPECT_FALSE(fs::exists(scan_.file("bands.h5")));

  AssembleOptions wide = options("wide.h5");
  wide.columns = 512;
  narrow.memory_mib = std::stoul(refused.error().hint.substr(refused.error().hint.find("mib ") + 4)) + 4;
  const auto bands = assemble_scan(narrow), whole = assemble_scan(wide);
  ASSERT_TRUE(bands) << bands.error().text();
  ASSERT_TRUE(whole) << whole.error().text();
  EXPECT_GT(bands->bands, 2);
  EXPECT_EQ(whole->bands, 1);
  auto a = maps::ObservationReader::open(scan_.file("bands.h5"));
  auto b = maps::ObservationReader::open(scan_.file("wide.h5"));
  ASSERT_TRUE(a && b);
  const auto block_a = a->read(0, 512, 0, 512), block_b = b->read(0, 512, 0, 512);
  ASSERT_TRUE(block_a && block_b);
  EXPECT_TRUE(block_a->value == block_b->value);
  EXPECT_TRUE(block_a->variance == block_b->variance);
  EXPECT_TRUE(block_a->validity == block_b->validity);
}

TEST_F(Assemble, WithoutRegistrationItSaysWhatToRun) {
  fs::remove(calibration::registration_path(scan_.path()));
  const auto missing = assemble_scan(options("none.h5"));
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().text(), HasSubstr("rig calibrate"));

  for (auto& pose : registration_.poses) {
    pose.registered = false;
    pose.reason = "hidden";
  }
  ASSERT_TRUE(calibration::write_registration(scan_.path(), registration_));
  const auto none = assemble_scan(options("none.h5"));
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().text(), HasSubstr("no pose of the scan is registered"));

  registration_.rig_sha256 = "0000";
  ASSERT_TRUE(calibration::write_registration(scan_.path(), registration_));
  const auto other = assemble_scan(options("none.h5"));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().text(), HasSubstr("another rig.toml"));
  EXPECT_FALSE(fs::exists(scan_.file("none.h5")));

  const auto nowhere = assemble_scan({"no/such/scan", "x.h5", 16, 1024, ""});
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(nowhere.error().text(), HasSubstr("no/such/scan"));
}

}  // namespace
}  // namespace rig::assemble
