// From frames to an observation map, through rig-calibrate's library and rig-assemble's, on a scan that the
// test renders itself.
#include "clients/assemble/assemble.h"

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/registration_file.h"
#include "calibration/scan_registration.h"
#include "core/base/hash.h"
#include "core/base/interrupt.h"
#include "core/geometry/sample_grid.h"
#include "core/maps/observation_map.h"
#include "core/scan/scan_directory.h"
#include "tests/calibration/synthetic_scan.h"

namespace rig::assemble {
namespace {

using geometry::Vec3;
using rig::testing::scan_albedo;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

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

  testing::SyntheticScan& scan_ = testing::SyntheticScan::shared();
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
        const testing::Rgb truth = scan_albedo(p.x, p.y);
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

// Ctrl-C in the middle leaves no file, whole or in part.
TEST_F(Assemble, InterruptedItLeavesNothing) {
  ::testing::GTEST_FLAG(death_test_style) = "threadsafe";
  const auto interrupted = [this] {
    base::catch_interrupts();
    std::raise(SIGINT);
    const auto made = assemble_scan(options("interrupted.h5"));
    const bool asked = !made && made.error().code == base::ErrorCode::interrupted;
    const bool clean =
        !fs::exists(scan_.file("interrupted.h5")) && !fs::exists(scan_.file("interrupted.h5.part"));
    std::exit(asked && clean ? 130 : 1);
  };
  EXPECT_EXIT(interrupted(), ::testing::ExitedWithCode(130), "");
}

}  // namespace
}  // namespace rig::assemble
