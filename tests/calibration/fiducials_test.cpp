#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/fiducials/edge_model.h"
#include "calibration/fiducials/tag_finder.h"
#include "calibration/registration.h"
#include "tests/calibration/synthetic.h"

namespace rig::calibration {
namespace {

using geometry::Vec2;

double distance(Vec2 a, Vec2 b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

// A tag drawn upright with square cells of `cell` pixels, its margin's upper left pixel at (left, top).
GreyImage drawn_tag(int id, int cell, int left, int top, int width, int height) {
  testing::TagArt art;
  art.load(id);
  GreyImage image{width, height, std::vector<float>(static_cast<std::size_t>(width * height), 900.0F)};
  for (int y = 0; y < testing::TagArt::kCells * cell; ++y) {
    for (int x = 0; x < testing::TagArt::kCells * cell; ++x) {
      image.pixels[static_cast<std::size_t>((top + y) * width + left + x)] =
          art.white(id, x / cell, y / cell) ? 1000.0F : 100.0F;
    }
  }
  return image;
}

TEST(EdgeModel, IsTheShareOfABlurredHalfPlaneInASquarePixel) {
  for (const double angle : {0.0, 0.3, 0.785, 1.5707, 2.5}) {
    const Vec2 normal{std::cos(angle), std::sin(angle)};
    for (const double blur : {0.2, 0.7}) {
      for (const double d : {-1.1, -0.4, 0.0, 0.25, 0.9}) {
        double sum = 0;
        constexpr int kSteps = 200;
        for (int j = 0; j < kSteps; ++j) {
          for (int i = 0; i < kSteps; ++i) {
            const double x = (i + 0.5) / kSteps - 0.5, y = (j + 0.5) / kSteps - 0.5;
            sum += 0.5 * std::erfc(-(d + x * normal.x + y * normal.y) / blur / std::sqrt(2.0));
          }
        }
        EXPECT_NEAR(edge_share(d, normal, blur).share, sum / (kSteps * kSteps), 1e-4)
            << "angle " << angle << " blur " << blur << " distance " << d;
        constexpr double kStep = 1e-5;
        const EdgeShare e = edge_share(d, normal, blur);
        EXPECT_NEAR(e.by_distance,
                    (edge_share(d + kStep, normal, blur).share - edge_share(d - kStep, normal, blur).share) /
                        (2 * kStep),
                    1e-5);
        EXPECT_NEAR(e.by_blur,
                    (edge_share(d, normal, blur + kStep).share - edge_share(d, normal, blur - kStep).share) /
                        (2 * kStep),
                    1e-5);
      }
    }
  }
}

// Pins both conventions at once: pixel (0,0) is a centre, so that a square whose first black pixel is column
// 40 has its left edge at 39.5; and the corners go lower left, lower right, upper right, upper left as drawn.
TEST(TagFinder, GivesCornersInOurPixelsAndOrder) {
  constexpr int kCell = 9, kLeft = 31, kTop = 52;
  const GreyImage image = drawn_tag(17, kCell, kLeft, kTop, 200, 220);
  const double left = kLeft + kCell - 0.5, right = left + 8 * kCell;
  const double top = kTop + kCell - 0.5, bottom = top + 8 * kCell;
  const std::array<Vec2, 4> expected{Vec2{left, bottom}, {right, bottom}, {right, top}, {left, top}};
  for (const bool refine : {false, true}) {
    TagFinderOptions options;
    options.decimate = 1;
    options.refine = refine;
    auto finder = TagFinder::create("tag36h11", options);
    ASSERT_TRUE(finder);
    const auto found = finder->find(image);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].id, 17);
    EXPECT_EQ(found[0].refined, refine);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_LT(distance(found[0].corners[i], expected[i]), refine ? 0.01 : 0.6)
          << "corner " << i << ": " << found[0].corners[i].x << ", " << found[0].corners[i].y;
    }
  }
}

TEST(TagFinder, FollowsATurnedTag) {
  const GreyImage upright = drawn_tag(5, 8, 60, 50, 200, 200);
  cv::Mat source(upright.height, upright.width, CV_32F, const_cast<float*>(upright.pixels.data())), turned;
  cv::rotate(source, turned, cv::ROTATE_90_CLOCKWISE);
  GreyImage image{turned.cols, turned.rows, {}};
  image.pixels.assign(turned.begin<float>(), turned.end<float>());
  auto finder = TagFinder::create("tag36h11");
  ASSERT_TRUE(finder);
  const auto before = finder->find(upright), after = finder->find(image);
  ASSERT_EQ(before.size(), 1U);
  ASSERT_EQ(after.size(), 1U);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec2 p = before[0].corners[i];
    EXPECT_LT(distance(after[0].corners[i], {upright.height - 1 - p.y, p.x}), 0.02) << "corner " << i;
  }
}

TEST(TagFinder, UnknownFamilyIsAnError) {
  const auto finder = TagFinder::create("tag99");
  ASSERT_FALSE(finder);
  EXPECT_THAT(finder.error().text(), ::testing::HasSubstr("tag36h11"));
}

TEST(TagFinder, EmptyImageHasNoTags) {
  auto finder = TagFinder::create("tag36h11");
  ASSERT_TRUE(finder);
  EXPECT_TRUE(finder->find(GreyImage{64, 64, std::vector<float>(64 * 64, 0.0F)}).empty());
}

TEST(GreyImage, IsEvenOverASaturatedAndOverANeutralArea) {
  const geometry::SensorModel sensor{12, 64, 4095, 8, 6};
  const std::array<double, 3> balance{1.6, 1.0, 1.4};
  std::vector<std::uint16_t> saturated(16, 4095), neutral(16);
  for (int i = 0; i < 16; ++i) {
    const auto colour =
        static_cast<std::size_t>(geometry::colour_at(geometry::BayerPattern::rggb, i % 4, i / 4));
    neutral[static_cast<std::size_t>(i)] =
        static_cast<std::uint16_t>(64 + std::lround(1120 / balance[colour]));
  }
  const auto grey = grey_from_mosaic(neutral, 4, 4, geometry::BayerPattern::rggb, sensor, balance);
  for (const float v : grey.pixels) EXPECT_NEAR(static_cast<double>(v), 1120, 1);
  const auto clipped = grey_from_mosaic(saturated, 4, 4, geometry::BayerPattern::rggb, sensor, balance);
  for (const float v : clipped.pixels) EXPECT_FLOAT_EQ(v, 4031.0F);
}

struct View {
  double roll_deg, tilt_deg, pan_deg;
};

class RenderedTags : public ::testing::TestWithParam<View> {};

// Corners against the projection of the truth, with noise: root mean square 0.05 px and a reported sigma that
// is honest within a factor of two.
TEST_P(RenderedTags, CornersAreRightToAFewHundredthsOfAPixel) {
  const machine::RigConfig rig = testing::small_rig();
  const testing::Carrier carrier(rig, [](double, double) { return testing::Rgb{0.2, 0.1, 0.05}; });
  const View view = GetParam();
  const auto camera_from_sample =
      testing::pose(view.roll_deg, view.tilt_deg, view.pan_deg, {0.0013, -0.0007, 0.002});
  const auto signal = testing::render(rig, carrier, camera_from_sample, {0.3, 0.4, 0.9}, {20e3, 32e3, 23e3});
  const auto mosaic = testing::expose(rig, signal, 0.3, 11);
  const GreyImage grey = grey_from_mosaic(mosaic, rig.camera.intrinsics.width, rig.camera.intrinsics.height,
                                          rig.camera.bayer, rig.camera.sensor, rig.camera.white_balance);
  auto finder = TagFinder::create("tag36h11");
  ASSERT_TRUE(finder);
  const auto found = finder->find(grey, &rig.camera.intrinsics);
  EXPECT_GE(found.size(), 10U);
  double squares = 0, expected = 0;
  int count = 0;
  for (const TagSighting& sighting : found) {
    const auto fiducial = std::find_if(rig.carrier.fiducials.begin(), rig.carrier.fiducials.end(),
                                       [&](const machine::Fiducial& f) { return f.id == sighting.id; });
    ASSERT_NE(fiducial, rig.carrier.fiducials.end()) << sighting.id;
    EXPECT_TRUE(sighting.refined) << sighting.id;
    const auto corners = tag_corners(*fiducial);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto pixel = geometry::project(rig.camera.intrinsics, camera_from_sample.point(corners[i]));
      ASSERT_TRUE(pixel);
      const double d = distance(*pixel, sighting.corners[i]);
      squares += d * d / 2;
      expected += sighting.corner_sigma_px[i] * sighting.corner_sigma_px[i];
      ++count;
    }
  }
  const double rms = std::sqrt(squares / count), sigma = std::sqrt(expected / count);
  std::cout << found.size() << " tags, rms " << rms << " px, expected " << sigma << " px\n";
  EXPECT_LT(rms, 0.05);
  EXPECT_LT(rms, 2 * sigma);
  EXPECT_GT(rms, sigma / 2);
}

INSTANTIATE_TEST_SUITE_P(Views, RenderedTags,
                         ::testing::Values(View{0, 0, 0}, View{17, 0, 0}, View{100, 35, 20}, View{-50, 60, 0},
                                           View{20, -15, 60}));

}  // namespace
}  // namespace rig::calibration
