// The figures of `rig live` against closed forms.
#include "clients/rig/live_measure.h"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "core/base/srgb.h"

namespace rig::client {
namespace {

using geometry::BayerPattern;

double normal_distribution(double x) {
  return 0.5 * std::erfc(-x / std::numbers::sqrt2);
}
double normal_density(double x) {
  return std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
}

// An edge in the middle, from 0 to 1, blurred by a Gaussian; sharp where sigma is 0.
Plane edge(int width, int height, double sigma_px, bool upright = true) {
  Plane plane{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double from_middle = upright ? x - 0.5 * (width - 1) : y - 0.5 * (height - 1);
      plane.pixels.push_back(static_cast<float>(sigma_px > 0 ? normal_distribution(from_middle / sigma_px)
                                                             : (from_middle < 0 ? 0.0 : 1.0)));
    }
  }
  return plane;
}

TEST(FocusMeasure, OfABlurredEdgeIsWhatTheIntegralSays) {
  constexpr int kWidth = 201;
  for (const double sigma : {1.0, 1.5, 2.0, 3.0, 5.0, 8.0}) {
    // Sobel's difference over two pixels is a box of width two over the edge's Gaussian; the integral of its
    // square is that of the triangle of width four against a Gaussian wider by the root of two.
    const double s = sigma * std::numbers::sqrt2;
    const double integral =
        2 * (2 * (normal_distribution(2 / s) - 0.5) - s * (normal_density(0) - normal_density(2 / s)));
    EXPECT_NEAR(focus_measure(edge(kWidth, 31, sigma)) / (1000 * integral / (kWidth - 2)), 1, 1e-4) << sigma;
  }
}

TEST(FocusMeasure, OfASharpEdgeIsTwoPixelsOfHalfASlope) {
  // 100 columns of 0, 100 of 1: the mean is a half.
  EXPECT_NEAR(focus_measure(edge(200, 31, 0)), 1000 * (2 * 0.25) / 198 / 0.25, 1e-9);
}

TEST(FocusMeasure, FallsWithEveryBitOfBlur) {
  double last = focus_measure(edge(201, 31, 0));
  for (double sigma = 0.2; sigma < 12; sigma *= 1.1) {
    const double now = focus_measure(edge(201, 31, sigma));
    EXPECT_LT(now, last * (1 + 1e-6)) << sigma;
    EXPECT_GT(now, 0) << sigma;
    last = now;
  }
}

TEST(FocusMeasure, DependsNeitherOnExposureNorOnDirection) {
  Plane plane = edge(101, 101, 2);
  const double full = focus_measure(plane);
  for (float& v : plane.pixels) v *= 0.3F;
  EXPECT_NEAR(focus_measure(plane) / full, 1, 1e-5);
  EXPECT_NEAR(focus_measure(edge(101, 101, 2, false)) / full, 1, 1e-5);
}

TEST(FocusMeasure, IsNothingWhereNothingCanBeSeen) {
  EXPECT_EQ(focus_measure({}), 0);
  EXPECT_EQ(focus_measure({2, 2, {1, 0, 0, 1}}), 0);
  EXPECT_EQ(focus_measure({3, 3, std::vector<float>(9, 0)}), 0);
  EXPECT_EQ(focus_measure({3, 3, std::vector<float>(9, -0.1F)}), 0);
  EXPECT_EQ(focus_measure({3, 3, std::vector<float>(9, 0.7F)}), 0);
}

constexpr geometry::SensorModel kSensor{12, 64, 4064, 8, 6};

TEST(Green, IsTakenFromTheGreenSamplesAlone) {
  constexpr int kWidth = 13;
  constexpr int kHeight = 9;
  for (const auto pattern :
       {BayerPattern::rggb, BayerPattern::bggr, BayerPattern::grbg, BayerPattern::gbrg}) {
    std::vector<std::uint16_t> mosaic;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const bool green = geometry::colour_at(pattern, x, y) == geometry::Colour::green;
        // Half of the range, one row in two a little more, the other a little less.
        mosaic.push_back(static_cast<std::uint16_t>(green ? (y % 2 == 0 ? 2164 : 1964) : 4095));
      }
    }
    for (const Region region : {Region{0, 0, kWidth, kHeight}, Region{1, 1, 12, 8}, Region{3, 2, 4, 3}}) {
      const Plane plane = green_of_mosaic(mosaic, kWidth, pattern, kSensor, region);
      EXPECT_EQ(plane.width, (region.x1 - (region.x0 + 1) / 2 * 2) / 2);
      ASSERT_EQ(plane.pixels.size(), static_cast<std::size_t>(plane.width * plane.height));
      EXPECT_THAT(plane.pixels, testing::Each(testing::FloatEq(0.5F)));
    }
  }
}

TEST(Green, OfASensorWithoutMosaicIsEverySample) {
  const std::vector<std::uint16_t> samples{64, 4064, 2064, 64, 1064, 0};
  const Plane plane = green_of_mosaic(samples, 3, BayerPattern::none, kSensor, {1, 0, 3, 2});
  EXPECT_EQ(plane.width, 2);
  EXPECT_THAT(plane.pixels, testing::ElementsAre(1.0F, 0.5F, 0.25F, -0.016F));
}

protocol::Frame preview_of(std::uint32_t width, std::uint32_t height, const std::string& rgb) {
  protocol::Frame frame;
  frame.set_preview_width(width);
  frame.set_preview_height(height);
  frame.set_preview_rgb(rgb);
  return frame;
}

TEST(Green, OfAPreviewIsLight) {
  const auto frame = preview_of(2, 1, {'\x00', '\xff', '\x00', '\x00', '\x80', '\x00'});
  EXPECT_THAT(green_of_preview(frame, {0, 0, 2, 1}).pixels,
              testing::ElementsAre(1.0F, testing::FloatNear(0.2159F, 1e-4F)));
  EXPECT_THAT(green_of_preview(frame, {1, 0, 2, 1}).pixels, testing::SizeIs(1));
}

TEST(Exposure, CountsWhatIsClippedExactly) {
  std::vector<std::uint16_t> mosaic(2000, 2064);
  for (std::size_t i = 0; i < 7; ++i) mosaic[i] = static_cast<std::uint16_t>(i % 2 == 0 ? 4064 : 4095);
  for (std::size_t i = 100; i < 130; ++i) mosaic[i] = static_cast<std::uint16_t>(i % 2 == 0 ? 64 : 3);
  mosaic[200] = 4063;
  mosaic[201] = 65;
  const Exposed all = exposed_of_mosaic(mosaic, 50, kSensor, {0, 0, 50, 40});
  EXPECT_DOUBLE_EQ(all.saturated_share, 7.0 / 2000);
  EXPECT_DOUBLE_EQ(all.black_share, 30.0 / 2000);
  EXPECT_EQ(all.level, 1);
  // Rows 0 and 1 hold the saturated ones: without them, and one bright sample in 1900 stays above the level.
  const Exposed rest = exposed_of_mosaic(mosaic, 50, kSensor, {0, 2, 50, 40});
  EXPECT_EQ(rest.saturated_share, 0);
  EXPECT_DOUBLE_EQ(rest.black_share, 30.0 / 1900);
  EXPECT_DOUBLE_EQ(rest.level, 0.5);
}

TEST(Exposure, TheLevelLeavesOneInAThousandAbove) {
  for (const std::size_t above : {0U, 1U, 2U}) {
    std::vector<std::uint16_t> mosaic(1000, 1064);
    for (std::size_t i = 0; i < above; ++i) mosaic[i] = 3064;
    EXPECT_DOUBLE_EQ(exposed_of_mosaic(mosaic, 100, kSensor, {0, 0, 100, 10}).level, above < 2 ? 0.25 : 0.75);
  }
}

TEST(Exposure, OfAPreviewCountsEveryColour) {
  const auto frame = preview_of(2, 1, {'\x00', '\xff', '\x80', '\x80', '\x80', '\x00'});
  const Exposed exposed = exposed_of_preview(frame, {0, 0, 2, 1});
  EXPECT_DOUBLE_EQ(exposed.saturated_share, 1.0 / 6);
  EXPECT_DOUBLE_EQ(exposed.black_share, 2.0 / 6);
  EXPECT_EQ(exposed.level, 1);
  EXPECT_NEAR(exposed_of_preview(frame, {1, 0, 2, 1}).level, base::linear_from_srgb(128 / 255.0), 1e-12);
}

TEST(Exposure, ComesToAGoodLevelFromAnywhere) {
  for (double brightness = 1e-7; brightness < 1; brightness *= 3) {
    double exposure = 20000;
    int steps = 0;
    for (; steps < 12; ++steps) {
      const double next = better_exposure(exposure, std::min(1.0, brightness * exposure));
      if (next == exposure) break;
      exposure = next;
    }
    EXPECT_LT(steps, 12) << brightness;
    EXPECT_NEAR(brightness * exposure, kGoodLevel, kLevelTolerance + 1e-9);
  }
  EXPECT_EQ(better_exposure(1000, 0), 8000);
}

TEST(Region, HoldsThePolygonAndStaysInTheImage) {
  const auto expect = [](const Region& region, int x0, int y0, int x1, int y1) {
    EXPECT_EQ(region.x0, x0);
    EXPECT_EQ(region.y0, y0);
    EXPECT_EQ(region.x1, x1);
    EXPECT_EQ(region.y1, y1);
  };
  expect(region_around({}, 40, 30), 0, 0, 40, 30);
  expect(region_around({{10.2, 5.5}, {20, 6}, {15, 9.1}}, 40, 30), 10, 5, 21, 11);
  expect(region_around({{-10, -5}, {20, 6}, {15, 90}}, 40, 30), 0, 0, 21, 30);
  // Out of sight: better the whole image than nothing.
  expect(region_around({{50, 5}, {60, 6}, {55, 9}}, 40, 30), 0, 0, 40, 30);
}

}  // namespace
}  // namespace rig::client
