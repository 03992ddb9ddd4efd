// The sensor's noise, its colour filter, and texels.
#include "core/geometry/sensor.h"

#include <gtest/gtest.h>
#include <random>

#include "core/base/random.h"
#include "core/geometry/sample_grid.h"
#include "tests/core/seed.h"

namespace rig::geometry {
namespace {

// Photons, read noise and rounding simulated one sample at a time, against the formula.
TEST(Sensor, VarianceIsThatOfASimulatedSensor) {
  SensorModel sensor;
  sensor.electrons_per_dn = 8;
  sensor.read_noise_e = 6;
  constexpr int kSamples = 200'000;
  std::mt19937_64 engine(5);
  for (const double signal_dn : {0.0, 3.0, 40.0, 700.0, 3500.0}) {
    std::poisson_distribution<int> photons(std::max(1e-12, signal_dn * sensor.electrons_per_dn));
    std::normal_distribution<double> read(0, sensor.read_noise_e);
    double sum = 0;
    double squares = 0;
    for (int i = 0; i < kSamples; ++i) {
      const double dn = std::round((photons(engine) + read(engine)) / sensor.electrons_per_dn);
      sum += dn;
      squares += dn * dn;
    }
    const double mean = sum / kSamples;
    const double variance = squares / kSamples - mean * mean;
    // The estimate of a variance of nearly normal values has a relative deviation of sqrt(2 / n): five of
    // them.
    EXPECT_NEAR(variance / sensor.variance_dn2(signal_dn), 1, 5 * std::sqrt(2.0 / kSamples)) << signal_dn;
  }
}

TEST(Sensor, BelowBlackThereIsOnlyReadNoise) {
  SensorModel sensor;
  sensor.electrons_per_dn = 4;
  sensor.read_noise_e = 8;
  EXPECT_DOUBLE_EQ(sensor.variance_dn2(-20), 4 + 1.0 / 12);
}

TEST(Bayer, TheFirstRowAndColumnReadAsTheName) {
  using enum Colour;
  const auto letter = [](Colour c) { return c == red ? 'R' : c == green ? 'G' : 'B'; };
  for (const auto pattern :
       {BayerPattern::rggb, BayerPattern::bggr, BayerPattern::grbg, BayerPattern::gbrg}) {
    for (const auto& [x, y] : {std::pair(0, 0), {2, 6}, {100, 44}}) {
      const std::string cell{letter(colour_at(pattern, x, y)), letter(colour_at(pattern, x + 1, y)),
                             letter(colour_at(pattern, x, y + 1)), letter(colour_at(pattern, x + 1, y + 1))};
      EXPECT_EQ(cell, text_from_bayer(pattern));
    }
  }
  EXPECT_EQ(colour_at(BayerPattern::none, 3, 4), green);
}

TEST(Bayer, NamesThereAndBack) {
  for (const auto pattern :
       {BayerPattern::none, BayerPattern::rggb, BayerPattern::bggr, BayerPattern::grbg, BayerPattern::gbrg}) {
    EXPECT_EQ(bayer_from_text(text_from_bayer(pattern)), pattern);
  }
  const auto unknown = bayer_from_text("RGBG");
  ASSERT_FALSE(unknown.has_value());
  EXPECT_EQ(unknown.error().code, base::ErrorCode::bad_input);
}

TEST(SampleGrid, TexelsTileTheSample) {
  const SampleGrid grid{512, 256, 0.16, 0.08};
  // Mortensen and Andersen 2007, 9.2: texel (0,0) is half a texel inside the corner of least x and y.
  EXPECT_DOUBLE_EQ(grid.centre(0, 0).x, -0.08 + 0.16 / 512 / 2);
  EXPECT_DOUBLE_EQ(grid.centre(0, 0).y, -0.04 + 0.08 / 256 / 2);
  EXPECT_DOUBLE_EQ(grid.centre(511, 255).x, 0.08 - 0.16 / 512 / 2);
  EXPECT_GT(grid.centre(0, 255).y, 0) << "row 0 is the edge of least y";
  EXPECT_DOUBLE_EQ(grid.texel({-0.08, -0.04, 0}).x, -0.5);
  EXPECT_DOUBLE_EQ(grid.texel({0.08, 0.04, 0}).y, 255.5);
  base::Random random(test::seed(6));
  for (int i = 0; i < 1000; ++i) {
    const int s = static_cast<int>(random.below(512));
    const int t = static_cast<int>(random.below(256));
    const Vec2 texel = grid.texel(grid.centre(s, t));
    EXPECT_NEAR(texel.x, s, 1e-10);
    EXPECT_NEAR(texel.y, t, 1e-10);
  }
}

}  // namespace
}  // namespace rig::geometry
