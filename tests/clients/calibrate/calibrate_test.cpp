#include "clients/calibrate/calibrate.h"

#include <csignal>
#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/registration_file.h"
#include "core/base/files.h"
#include "core/base/interrupt.h"
#include "tests/calibration/synthetic_scan.h"

namespace rig::calibrate {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class Calibrate : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(scan_.trouble(), "");
    fs::remove(calibration::registration_path(scan_.path()));
  }

  testing::SyntheticScan& scan_ = testing::SyntheticScan::shared();
};

TEST_F(Calibrate, RegistersAScanAndListsWhatItLeavesOut) {
  const auto summary = calibrate_scan(scan_.path(), {});
  ASSERT_TRUE(summary) << summary.error().text();
  EXPECT_EQ(summary->planned, 5U);
  EXPECT_EQ(summary->taken, 5U);
  EXPECT_EQ(summary->registered(), 4U);
  EXPECT_THAT(summary->text(), HasSubstr("4 of 5 poses registered"));
  EXPECT_THAT(summary->text(), HasSubstr("row 3 left out: 0 of the carrier's 12 tags found"));
  const auto file = calibration::read_registration(scan_.path());
  ASSERT_TRUE(file) << file.error().text();
  ASSERT_EQ(file->poses.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(file->poses[i].row, static_cast<std::int64_t>(i));
    EXPECT_EQ(file->poses[i].registered, i != 3);
  }
  // The motors were off by up to 0.4 degrees an axis, and that shows.
  EXPECT_GT(file->poses[0].turn_rad, base::radians(0.05));
  EXPECT_LT(file->poses[0].turn_rad, base::radians(0.7));
}

TEST_F(Calibrate, LimitsRejectWithTheirFigures) {
  calibration::RegistrationLimits limits;
  limits.most_turn_rad = 1e-6;
  const auto summary = calibrate_scan(scan_.path(), limits);
  ASSERT_TRUE(summary) << summary.error().text();
  EXPECT_EQ(summary->registered(), 0U);
  EXPECT_THAT(summary->text(), HasSubstr("from where the motors say"));
}

TEST_F(Calibrate, ARunIsTheSameAsTheNext) {
  ASSERT_TRUE(calibrate_scan(scan_.path(), {}));
  const auto first = base::read_file(calibration::registration_path(scan_.path()));
  ASSERT_TRUE(calibrate_scan(scan_.path(), {}));
  const auto second = base::read_file(calibration::registration_path(scan_.path()));
  ASSERT_TRUE(first && second);
  EXPECT_EQ(*first, *second);
}

TEST_F(Calibrate, NoScanIsAnError) {
  const auto none = calibrate_scan("no/such/scan", {});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().text(), HasSubstr("no/such/scan"));
}

TEST_F(Calibrate, InterruptedItLeavesTheFileAsItWas) {
  ::testing::GTEST_FLAG(death_test_style) = "threadsafe";
  const auto interrupted = [this] {
    base::catch_interrupts();
    std::raise(SIGINT);
    const auto made = calibrate_scan(scan_.path(), {});
    const bool asked = !made && made.error().code == base::ErrorCode::interrupted;
    std::exit(asked && !fs::exists(calibration::registration_path(scan_.path())) ? 130 : 1);
  };
  EXPECT_EXIT(interrupted(), ::testing::ExitedWithCode(130), "");
}

}  // namespace
}  // namespace rig::calibrate
