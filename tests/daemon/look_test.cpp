// What is measured of a reference visit's frames.
#include "daemon/look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/machine/kinematics.h"
#include "core/scan/visits.h"
#include "tests/core/temporary_folder.h"
#include "tests/daemon/small_setup.h"

namespace rig::daemon::testing {
namespace {

using ::testing::HasSubstr;

constexpr double kBlack_dn = 64;

class FlatLook : public ::testing::Test {
 protected:
  FlatLook() {
    rig_.camera.sensor.black_dn = kBlack_dn;
    rig_.unattended.reference = some_reference();
    rig_.unattended.reference->flat = some_flat();
    pixels_.assign(static_cast<std::size_t>(width_ * height_), 64 + 1000);
  }
  base::Result<LookFinding> look() {
    JudgeLook look{};
    look.kind = Visit::Kind::reference;
    look.visit = 3;
    look.name = "flat";
    look.info.exposure_s = 0.01;
    look.target_rad = some_flat().pose_rad;
    return judge(rig_, folder_.path(), look, pixels_);
  }
  void fill(int x0, int y0, int x1, int y1, std::uint16_t value) {
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) pixels_[static_cast<std::size_t>(y * width_ + x)] = value;
    }
  }

  machine::RigConfig rig_ = small_setup().rig;
  const int width_ = rig_.camera.intrinsics.width, height_ = rig_.camera.intrinsics.height;
  std::vector<std::uint16_t> pixels_;
  test::TemporaryFolder folder_;
};

TEST_F(FlatLook, IsMeasuredInSixteenPartsOfTheImageAndStored) {
  // The second of the first row, to its last pixel.
  fill(width_ / 4, 0, width_ / 2, height_ / 4, 64 + 500);
  const auto finding = look();
  ASSERT_TRUE(finding.has_value()) << finding.error().text();
  const auto& means = finding->record.means_dn;
  ASSERT_EQ(means.size(), 16U);
  for (std::size_t i = 0; i < means.size(); ++i) EXPECT_NEAR(means[i], i == 1 ? 500 : 1000, 1e-9) << i;
  EXPECT_EQ(finding->record.file, "references/000003/flat.tif");
  EXPECT_TRUE(std::filesystem::exists(scan::visit_part_folder(folder_.path(), 3) / "flat.tif"));
}

TEST_F(FlatLook, OfATargetOnTheCarrierOnlyThatCounts) {
  rig_.unattended.reference->flat->target = machine::FlatConfig::Target{0, 0.02, 0.04, 0.03};
  fill(0, 0, width_, height_, 4095);  // all that is beside it
  const auto outline = machine::rectangle_outline(rig_, some_flat().pose_rad, {0, 0.02}, 0.04, 0.03).value();
  double x0 = width_, x1 = 0, y0 = height_, y1 = 0;
  for (const auto& corner : outline) {
    x0 = std::min(x0, corner.x);
    x1 = std::max(x1, corner.x);
    y0 = std::min(y0, corner.y);
    y1 = std::max(y1, corner.y);
  }
  fill(static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(x1) + 1, static_cast<int>(y1) + 1,
       64 + 700);
  const auto finding = look();
  ASSERT_TRUE(finding.has_value()) << finding.error().text();
  ASSERT_EQ(finding->record.means_dn.size(), 16U);
  for (const double mean : finding->record.means_dn) EXPECT_NEAR(mean, 700, 1e-9);
}

TEST_F(FlatLook, OneThatIsSaturatedShowsNothing) {
  fill(0, 0, width_ / 8, height_ / 8, 4095);
  const auto finding = look();
  ASSERT_FALSE(finding.has_value());
  EXPECT_THAT(finding.error().text(), HasSubstr("shorten [reference.flat] exposure_ms"));
}

}  // namespace
}  // namespace rig::daemon::testing
