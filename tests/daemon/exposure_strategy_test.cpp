#include "daemon/exposure_strategy.h"

#include <gtest/gtest.h>

#include "core/machine/exposure_prediction.h"
#include "tests/daemon/small_setup.h"

namespace rig::daemon {
namespace {

using Kind = NextExposure::Kind;

scan::FrameRecord seen(double saturated_share) {
  scan::FrameRecord frame;
  frame.saturated_share = saturated_share;
  return frame;
}

NextExposure next_exposure(const machine::ExposureConfig& config, std::size_t triggered,
                           const std::vector<scan::FrameRecord>& fetched) {
  static const Setup setup = testing::small_setup();
  PoseTake take;
  take.triggered = triggered;
  take.frames = fetched;
  return daemon::next_exposure(setup, config, take);
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

TEST(Predicted, TakesTheBracketOfThePosesAngleAndWaitsForNone) {
  const daemon::Setup setup = testing::small_setup();
  machine::ExposureConfig config;
  config.strategy = machine::ExposureStrategy::predicted;
  config.lightest_s = {0.02, 0.001};
  config.darkest_s = {0.5, 0.1};
  config.darkest_rad = base::radians(90);
  PoseTake take;
  take.target_rad = testing::some_poses().front();
  const auto bracket =
      machine::predicted_bracket_s(config, machine::mirror_angle_rad(setup.rig, take.target_rad));
  for (take.triggered = 0; take.triggered < 2; ++take.triggered) {
    const auto next = daemon::next_exposure(setup, config, take);
    EXPECT_EQ(next.kind, Kind::expose);
    EXPECT_EQ(next.exposure_s, bracket[take.triggered]);
    EXPECT_EQ(next.last, take.triggered == 1);
  }
  EXPECT_EQ(daemon::next_exposure(setup, config, take).kind, Kind::complete);
  EXPECT_FALSE(shortfall(setup, config, take).has_value());
}

TEST(Adaptive, SeesEveryFrameBeforeTheNext) {
  const daemon::Setup setup = testing::small_setup();
  machine::ExposureConfig config;
  config.strategy = machine::ExposureStrategy::adaptive;
  config.first_s = 0.01;
  config.longest_s = 1;
  config.most_frames = 2;
  config.snr = 20;
  PoseTake take;
  const auto first = daemon::next_exposure(setup, config, take);
  EXPECT_EQ(first.exposure_s, 0.01);
  EXPECT_FALSE(first.last);
  take.triggered = 1;
  EXPECT_EQ(daemon::next_exposure(setup, config, take).kind, Kind::wait_for_frame);
  // Half of the pixels 100 above black, half 4: a signal-to-noise ratio of 20 needs more of these.
  auto histogram = std::make_shared<SampleHistogram>();
  histogram->counts[1].resize(4096);
  histogram->counts[1][164] = 50;
  histogram->counts[1][68] = 50;
  take.frames.push_back(seen(0));
  take.frames.back().exposure_s = 0.01;
  take.histograms.emplace_back(histogram);
  EXPECT_EQ(shortfall(setup, config, take), 0.5) << "8 electrons each are not enough";
  const auto second = daemon::next_exposure(setup, config, take);
  EXPECT_EQ(second.kind, Kind::expose);
  EXPECT_TRUE(second.last);
  EXPECT_GT(second.exposure_s, 0.1);
  config.snr = 2;
  EXPECT_EQ(daemon::next_exposure(setup, config, take).kind, Kind::complete);
  EXPECT_EQ(shortfall(setup, config, take), 0.0);
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
