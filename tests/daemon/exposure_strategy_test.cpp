#include "daemon/exposure_strategy.h"

#include <gtest/gtest.h>

namespace rig::daemon {
namespace {

using Kind = NextExposure::Kind;

scan::FrameRecord seen(double saturated_share) {
  scan::FrameRecord frame;
  frame.saturated_share = saturated_share;
  return frame;
}

TEST(FixedList, TakesEveryExposureInOrderAndWaitsForNone) {
  machine::ExposureConfig config;
  config.exposures_s = {0.16, 0.02, 0.0025};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto next = next_exposure(config, i, {});
    EXPECT_EQ(next.kind, Kind::expose);
    EXPECT_EQ(next.exposure_s, config.exposures_s[i]);
    EXPECT_EQ(next.last, i == 2);
  }
  EXPECT_EQ(next_exposure(config, 3, {}).kind, Kind::complete);
}

class Halving : public ::testing::Test {
 protected:
  machine::ExposureConfig config_;
  void SetUp() override {
    config_.strategy = machine::ExposureStrategy::halve;
    config_.longest_s = 0.4;
    config_.most_frames = 4;
    config_.saturated_share = 0.01;
  }
};

TEST_F(Halving, BeginsWithTheLongestAndSeesItFirst) {
  const auto first = next_exposure(config_, 0, {});
  EXPECT_EQ(first.kind, Kind::expose);
  EXPECT_EQ(first.exposure_s, 0.4);
  EXPECT_FALSE(first.last);
  EXPECT_EQ(next_exposure(config_, 1, {}).kind, Kind::wait_for_frame);
}

TEST_F(Halving, HalvesUntilTheSampleIsNotSaturated) {
  const auto second = next_exposure(config_, 1, {seen(0.5)});
  EXPECT_EQ(second.kind, Kind::expose);
  EXPECT_DOUBLE_EQ(second.exposure_s, 0.2);
  const auto third = next_exposure(config_, 2, {seen(0.5), seen(0.011)});
  EXPECT_DOUBLE_EQ(third.exposure_s, 0.1);
  EXPECT_EQ(next_exposure(config_, 3, {seen(0.5), seen(0.011), seen(0.01)}).kind, Kind::complete);
  EXPECT_EQ(next_exposure(config_, 1, {seen(0)}).kind, Kind::complete);
}

TEST_F(Halving, EndsAtTheBoundAndSaysSoBefore) {
  const auto fourth = next_exposure(config_, 3, {seen(1), seen(1), seen(1)});
  EXPECT_DOUBLE_EQ(fourth.exposure_s, 0.05);
  EXPECT_TRUE(fourth.last);
  EXPECT_EQ(next_exposure(config_, 4, {seen(1), seen(1), seen(1), seen(1)}).kind, Kind::complete);
  config_.most_frames = 1;
  EXPECT_TRUE(next_exposure(config_, 0, {}).last);
}

}  // namespace
}  // namespace rig::daemon
