#include "calibration/hdr_merge.h"

#include <cmath>
#include <gtest/gtest.h>
#include <iostream>
#include <random>

namespace rig::calibration {
namespace {

const geometry::SensorModel kSensor{12, 64, 4095, 8, 6};

RadianceImage merge(const std::vector<std::vector<std::uint16_t>>& frames, const std::vector<double>& times,
                    const std::vector<double>& gains = {}) {
  std::vector<Exposure> exposures;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    exposures.push_back({frames[i].data(), times[i], gains.empty() ? 1.0 : gains[i]});
  }
  const int width = static_cast<int>(frames[0].size());
  return merge_exposures(exposures, width, kSensor, {0, 0, width, 1});
}

TEST(HdrMerge, OneExposureIsTheSampleOverTime) {
  const auto image = merge({{64, 164, 1064}}, {0.02});
  EXPECT_FLOAT_EQ(image.value[0], 0);
  EXPECT_FLOAT_EQ(image.value[1], 100 / 0.02F);
  EXPECT_FLOAT_EQ(image.value[2], 1000 / 0.02F);
  // Photon noise 1000/8, read noise (6/8)^2, quantisation 1/12.
  EXPECT_NEAR(image.variance[2], (1000.0 / 8 + 0.5625 + 1.0 / 12) / 4e-4, 10);
  EXPECT_EQ(image.saturated[2], 0);
}

TEST(HdrMerge, WeighsByTimeSquaredOverVariance) {
  // Two samples that contradict each other show the weights.
  const double t1 = 0.01, t2 = 0.04, d1 = 220, d2 = 800;
  const auto image = merge({{64 + 220}, {64 + 800}}, {t1, t2});
  double estimate = (d1 + d2) / (t1 + t2);
  for (int i = 0; i < 50; ++i) {
    const double w1 = 1 / kSensor.variance_dn2(estimate * t1), w2 = 1 / kSensor.variance_dn2(estimate * t2);
    estimate = (w1 * t1 * d1 + w2 * t2 * d2) / (w1 * t1 * t1 + w2 * t2 * t2);
  }
  EXPECT_NEAR(static_cast<double>(image.value[0]), estimate, 1e-4 * estimate);
  const double information =
      t1 * t1 / kSensor.variance_dn2(estimate * t1) + t2 * t2 / kSensor.variance_dn2(estimate * t2);
  EXPECT_NEAR(static_cast<double>(image.variance[0]), 1 / information, 1e-3 / information);
}

TEST(HdrMerge, SaturatedSamplesAreLeftOutAndBoundTheRestFromBelow) {
  const auto image = merge({{4095, 4095, 1064}, {564, 4095, 114}}, {0.16, 0.02});
  EXPECT_FLOAT_EQ(image.value[0], 500 / 0.02F);
  EXPECT_EQ(image.saturated[0], 0);
  EXPECT_EQ(image.saturated[1], 1);
  EXPECT_FLOAT_EQ(image.value[1], (4095 - 64) / 0.02F);
  EXPECT_GT(image.variance[1], 0);
  EXPECT_EQ(image.saturated[2], 0);
}

TEST(HdrMerge, GainCountsAsExposureButNotAsLight) {
  // The same digital numbers from half the light at twice the gain: half the electrons, twice the variance.
  const auto low = merge({{64 + 1000}}, {0.02}), high = merge({{64 + 1000}}, {0.01}, {2.0});
  EXPECT_FLOAT_EQ(low.value[0], high.value[0]);
  EXPECT_NEAR(static_cast<double>(high.variance[0] / low.variance[0]), 2.0, 0.03);
}

TEST(HdrMerge, ARectangleIsThatPartOfTheWhole) {
  constexpr int kWidth = 40, kHeight = 30;
  std::mt19937 random(3);
  std::vector<std::uint16_t> frame(kWidth * kHeight);
  for (auto& sample : frame) sample = static_cast<std::uint16_t>(random() % 4096);
  const Exposure exposure{frame.data(), 0.01, 1};
  const auto whole = merge_exposures({&exposure, 1}, kWidth, kSensor, {0, 0, kWidth, kHeight});
  const auto part = merge_exposures({&exposure, 1}, kWidth, kSensor, {7, 5, 20, 11});
  for (int y = 5; y < 16; ++y) {
    for (int x = 7; x < 27; ++x) EXPECT_EQ(part.value[part.index(x, y)], whole.value[whole.index(x, y)]);
  }
}

class HdrMonteCarlo : public ::testing::TestWithParam<double> {};

// Poisson electrons, Gaussian read noise, rounding and clipping, through the demonstration's bracket: no bias
// that matters, the variance that is reported, and that at the Cramer-Rao bound.
TEST_P(HdrMonteCarlo, ReachesTheBoundWithoutBias) {
  const double signal_at_longest_dn = GetParam();
  constexpr unsigned kSeed = 20240611;
  constexpr std::size_t kDraws = 100000;
  const std::vector<double> times{0.160, 0.020, 0.0025};
  const double radiance = signal_at_longest_dn / times[0];
  std::mt19937_64 random(kSeed);
  std::vector<std::vector<std::uint16_t>> frames;
  double information = 0;
  bool near_saturation = false;
  for (const double t : times) {
    const double mean_e = radiance * t * kSensor.electrons_per_dn;
    std::poisson_distribution<long> photons(mean_e);
    std::normal_distribution<double> read(0, kSensor.read_noise_e);
    auto& frame = frames.emplace_back(kDraws);
    for (auto& sample : frame) {
      const double electrons = static_cast<double>(photons(random)) + read(random);
      const double dn = std::round(kSensor.black_dn + electrons / kSensor.electrons_per_dn);
      sample = static_cast<std::uint16_t>(std::clamp(dn, 0.0, kSensor.saturation_dn));
    }
    const double variance = kSensor.variance_dn2(radiance * t);
    const double room = kSensor.saturation_dn - kSensor.black_dn - radiance * t;
    if (room > 0) information += t * t / variance;
    near_saturation = near_saturation || std::abs(room) < 5 * std::sqrt(variance);
  }
  const auto image = merge(frames, times);
  double mean = 0, square = 0, reported = 0;
  for (std::size_t i = 0; i < kDraws; ++i) {
    ASSERT_EQ(image.saturated[i], 0);
    mean += static_cast<double>(image.value[i]) / kDraws;
    reported += static_cast<double>(image.variance[i]) / kDraws;
  }
  for (std::size_t i = 0; i < kDraws; ++i) {
    const double d = static_cast<double>(image.value[i]) - mean;
    square += d * d / kDraws;
  }
  const double bound = 1 / information;
  std::cout << "seed " << kSeed << ", signal " << signal_at_longest_dn << " DN: bias "
            << 100 * (mean / radiance - 1) << " %, variance/bound " << square / bound << ", reported/true "
            << reported / square << '\n';
  // Five standard errors of the mean; where a sample is saturated half the time, those that are not are the
  // low ones: a quarter of a percent.
  const double tolerance =
      5 * std::sqrt(square / kDraws) + (near_saturation ? 0.0025 * radiance : 1e-4 * radiance);
  EXPECT_NEAR(mean, radiance, tolerance);
  if (near_saturation) return;
  // The variance of 1e5 draws is known to 0.45 %.
  EXPECT_NEAR(square / bound, 1, 0.025);
  EXPECT_NEAR(reported / square, 1, 0.025);
}

INSTANTIATE_TEST_SUITE_P(Signals, HdrMonteCarlo,
                         ::testing::Values(2.0, 20.0, 300.0, 3000.0, 4031.0, 10000.0, 31500.0, 100000.0));

}  // namespace
}  // namespace rig::calibration
