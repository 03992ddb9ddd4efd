#include "calibration/rectify.h"

#include <gtest/gtest.h>

#include "tests/calibration/synthetic.h"

namespace rig::calibration {
namespace {

using geometry::BayerPattern;
using geometry::SampleGrid;
using geometry::Vec2;
using geometry::Vec3;

// An image of the small rig whose mosaic has, for each colour, the value of `field` at the pixel.
template <typename Field>
RadianceImage mosaic_of(const machine::RigConfig& rig, Field&& field) {
  const auto& camera = rig.camera.intrinsics;
  RadianceImage image;
  image.rect = {0, 0, camera.width, camera.height};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      image.value.push_back(static_cast<float>(
          field(static_cast<std::size_t>(geometry::colour_at(rig.camera.bayer, x, y)), x, y)));
    }
  }
  image.variance.assign(image.value.size(), 1.0F);
  image.saturated.assign(image.value.size(), 0);
  return image;
}

struct Setting {
  BayerPattern pattern;
  int columns;
  double roll_deg, tilt_deg;
};

class RectifyLinear : public ::testing::TestWithParam<Setting> {};

// A linear field in each colour, different ones: each texel must hold the field at its middle, to the
// bending of its footprint, for every pattern, at magnification, at a texel of 1.5 pixels, at reduction.
TEST_P(RectifyLinear, KeepsEachColoursGradient) {
  auto rig = testing::small_rig();
  rig.camera.bayer = GetParam().pattern;
  const auto field = [](std::size_t colour, double x, double y) {
    constexpr std::array<std::array<double, 3>, 3> kPlane{
        {{500, 1.1, -0.3}, {300, -0.4, 0.9}, {100, 0.2, 0.7}}};
    return kPlane[colour][0] + kPlane[colour][1] * x + kPlane[colour][2] * y;
  };
  const auto image = mosaic_of(rig, field);
  const auto pose = testing::pose(GetParam().roll_deg, GetParam().tilt_deg, 10);
  const SampleGrid grid{GetParam().columns, GetParam().columns, 0.04, 0.04};
  const auto map = rectify(image, rig.camera.intrinsics, rig.camera.bayer, pose, grid, 0, grid.rows);
  for (int t = 0; t < grid.rows; ++t) {
    for (int s = 0; s < grid.columns; ++s) {
      const auto texel = static_cast<std::size_t>(t * grid.columns + s);
      ASSERT_EQ(map.state[texel], TexelState::good);
      const auto middle = *geometry::project(rig.camera.intrinsics, pose.point(grid.centre(s, t)));
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t colour = rig.camera.bayer == BayerPattern::none ? 1 : c;
        ASSERT_NEAR(static_cast<double>(map.value[3 * texel + c]), field(colour, middle.x, middle.y), 2e-3)
            << "texel " << s << ", " << t << " channel " << c;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Settings, RectifyLinear,
    ::testing::Values(Setting{BayerPattern::rggb, 128, 0, 0}, Setting{BayerPattern::bggr, 128, 30, 60},
                      Setting{BayerPattern::grbg, 512, 45, 20}, Setting{BayerPattern::gbrg, 20, 10, 70},
                      Setting{BayerPattern::none, 100, 5, 40}, Setting{BayerPattern::rggb, 3, 20, 0}));

// Reduction is a mean over area: stripes much finer than a texel become their mean.
TEST(Rectify, AveragesWhatIsFinerThanATexel) {
  const auto rig = testing::small_rig();
  const auto image =
      mosaic_of(rig, [](std::size_t, int x, int y) { return ((x + y) / 4) % 2 == 0 ? 0.0 : 2.0; });
  const SampleGrid grid{5, 5, 0.04, 0.04};
  const auto map =
      rectify(image, rig.camera.intrinsics, rig.camera.bayer, testing::pose(3, 10, 0), grid, 0, 5);
  for (const float v : map.value) EXPECT_NEAR(static_cast<double>(v), 1.0, 0.05);
}

// The variance that is reported is that of many noisy images.
TEST(Rectify, VarianceIsThatOfManyImages) {
  const auto rig = testing::small_rig();
  const auto pose = testing::pose(20, 50, 0);
  const SampleGrid grid{24, 24, 0.0072, 0.0072};
  constexpr int kImages = 600;
  constexpr std::uint64_t kSeed = 9;
  const std::size_t values = 3 * 24 * 24;
  std::vector<double> sum(values), squares(values), reported(values);
  RadianceImage image = mosaic_of(rig, [](std::size_t, int, int) { return 0.0; });
  const PixelRect needed = pixels_of_rows(rig.camera.intrinsics, pose, grid, 0, 24);
  for (int i = 0; i < kImages; ++i) {
    base::Random random(base::derive_key(kSeed, static_cast<std::uint64_t>(i)));
    for (int y = needed.y; y < needed.y + needed.height; ++y) {
      for (int x = needed.x; x < needed.x + needed.width; ++x) {
        image.value[image.index(x, y)] = static_cast<float>(random.normal());
      }
    }
    const auto map = rectify(image, rig.camera.intrinsics, rig.camera.bayer, pose, grid, 0, 24);
    for (std::size_t j = 0; j < values; ++j) {
      const auto v = static_cast<double>(map.value[j]);
      sum[j] += v / kImages, squares[j] += v * v / kImages;
      reported[j] = static_cast<double>(map.variance[j]);
    }
  }
  double ratio = 0;
  for (std::size_t j = 0; j < values; ++j) {
    ratio += squares[j] / reported[j] / static_cast<double>(values);
    // A variance from 600 draws scatters by 5.8 %: six of that.
    EXPECT_NEAR(squares[j] / reported[j], 1, 0.35);
  }
  std::cout << "seed " << kSeed << ": mean of variance over reported " << ratio << '\n';
  EXPECT_NEAR(ratio, 1, 0.02);
}

TEST(Rectify, ASaturatedSampleMarksTheTexelsItIsIn) {
  const auto rig = testing::small_rig();
  RadianceImage image = mosaic_of(rig, [](std::size_t, int, int) { return 1.0; });
  const auto pose = testing::pose(0, 0, 0);
  const SampleGrid grid{128, 128, 0.04, 0.04};
  const Vec2 middle = *geometry::project(rig.camera.intrinsics, pose.point(grid.centre(64, 64)));
  const int x = static_cast<int>(std::lround(middle.x)), y = static_cast<int>(std::lround(middle.y));
  image.saturated[image.index(x, y)] = 1;
  const auto map = rectify(image, rig.camera.intrinsics, rig.camera.bayer, pose, grid, 0, 128);
  EXPECT_EQ(map.state[64 * 128 + 64], TexelState::saturated);
  const auto marked = std::count(map.state.begin(), map.state.end(), TexelState::saturated);
  EXPECT_GE(marked, 1);
  // Texels are 1.56 pixels and a sample reaches two pixels: at most four by four.
  EXPECT_LE(marked, 16);
}

TEST(Rectify, WhatIsOutsideOrBehindIsMissing) {
  const auto rig = testing::small_rig();
  const RadianceImage image = mosaic_of(rig, [](std::size_t, int, int) { return 1.0; });
  const SampleGrid grid{16, 16, 0.04, 0.04};
  const auto aside = rectify(image, rig.camera.intrinsics, rig.camera.bayer,
                             testing::pose(0, 0, 0, {0.064, 0, 0}), grid, 0, 16);
  EXPECT_EQ(aside.state[0], TexelState::good);
  EXPECT_EQ(aside.state[15], TexelState::missing);
  const auto behind =
      rectify(image, rig.camera.intrinsics, rig.camera.bayer, testing::pose(0, 180, 0), grid, 0, 16);
  EXPECT_EQ(std::count(behind.state.begin(), behind.state.end(), TexelState::missing), 256);
  const auto away = testing::pose(0, 0, 0, {5, 0, 0});
  EXPECT_EQ(pixels_of_rows(rig.camera.intrinsics, away, grid, 0, 16).width, 0);
}

// Some rows from the part of the image that they need are the same rows of the whole.
TEST(Rectify, RowsFromTheirPartOfTheImageAreThoseOfTheWhole) {
  const auto rig = testing::small_rig();
  base::Random random(5);
  const RadianceImage image = mosaic_of(rig, [&](std::size_t, int, int) { return random.uniform(); });
  const auto pose = testing::pose(33, 55, -12);
  const SampleGrid grid{96, 96, 0.04, 0.04};
  const auto whole = rectify(image, rig.camera.intrinsics, rig.camera.bayer, pose, grid, 0, 96);
  for (const int first : {0, 32, 64}) {
    const PixelRect rect = pixels_of_rows(rig.camera.intrinsics, pose, grid, first, 32);
    RadianceImage part;
    part.rect = rect;
    for (int y = rect.y; y < rect.y + rect.height; ++y) {
      for (int x = rect.x; x < rect.x + rect.width; ++x) {
        part.value.push_back(image.value[image.index(x, y)]);
        part.variance.push_back(1.0F);
        part.saturated.push_back(0);
      }
    }
    const auto rows = rectify(part, rig.camera.intrinsics, rig.camera.bayer, pose, grid, first, 32);
    for (std::size_t i = 0; i < rows.state.size(); ++i) {
      const std::size_t j = i + static_cast<std::size_t>(first) * 96;
      ASSERT_EQ(rows.state[i], whole.state[j]);
      ASSERT_EQ(rows.value[3 * i], whole.value[3 * j]);
      ASSERT_EQ(rows.variance[3 * i + 2], whole.variance[3 * j + 2]);
    }
  }
}

}  // namespace
}  // namespace rig::calibration
