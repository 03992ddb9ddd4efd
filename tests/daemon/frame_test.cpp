// The frame pool, and what is said about a frame.
#include <cmath>
#include <gtest/gtest.h>
#include <set>
#include <stdexcept>

#include "core/base/random.h"
#include "daemon/frame_facts.h"
#include "daemon/frame_pool.h"
#include "tests/core/seed.h"

namespace rig::daemon {
namespace {

machine::CameraConfig camera_of(int width, int height) {
  machine::CameraConfig camera;
  camera.intrinsics.width = width;
  camera.intrinsics.height = height;
  camera.sensor.black_dn = 64;
  camera.sensor.saturation_dn = 4095;
  camera.bayer = geometry::BayerPattern::rggb;
  return camera;
}

// Whether a point is left of every edge of a convex polygon, counter-clockwise as seen with y down or up.
bool inside(const std::vector<geometry::Vec2>& polygon, double x, double y) {
  bool all_left = true;
  bool all_right = true;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto a = polygon[i];
    const auto b = polygon[(i + 1) % polygon.size()];
    const double side = (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
    all_left = all_left && side > 0;
    all_right = all_right && side < 0;
  }
  return all_left || all_right;
}

TEST(SaturatedShare, EqualsACountPixelByPixel) {
  base::Random random(test::seed(5));
  for (int round = 0; round < 200; ++round) {
    const int width = static_cast<int>(8 + random.below(60));
    const int height = static_cast<int>(8 + random.below(40));
    const auto camera = camera_of(width, height);
    std::vector<std::uint16_t> pixels(static_cast<std::size_t>(width * height));
    for (auto& p : pixels) p = random.below(3) == 0 ? 4095 : static_cast<std::uint16_t>(random.below(4095));
    // A convex polygon: points of a turned ellipse that may reach out of the image.
    std::vector<geometry::Vec2> polygon;
    const double cx = random.uniform(0, width);
    const double cy = random.uniform(0, height);
    const double rx = random.uniform(3, 50);
    const double ry = random.uniform(3, 50);
    const double turn = random.uniform(0, 3);
    for (int i = 0; i < 4; ++i) {
      const double t = turn + i * 1.5708;
      polygon.push_back({cx + rx * std::cos(t), cy + ry * std::sin(t)});
    }
    std::size_t seen = 0;
    std::size_t saturated = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        if (!inside(polygon, x, y)) continue;
        ++seen;
        if (pixels[static_cast<std::size_t>(y * width + x)] >= 4095) ++saturated;
      }
    }
    const double share = seen == 0 ? 0 : static_cast<double>(saturated) / static_cast<double>(seen);
    EXPECT_DOUBLE_EQ(saturated_share(camera, pixels, polygon), share) << "round " << round;
  }
}

TEST(SaturatedShare, IsOfTheWholeImageWithoutAnOutlineAndNoneBesideIt) {
  const auto camera = camera_of(4, 2);
  const std::vector<std::uint16_t> pixels{4095, 0, 0, 0, 4095, 0, 0, 4094};
  EXPECT_DOUBLE_EQ(saturated_share(camera, pixels, {}), 0.25);
  EXPECT_EQ(saturated_share(camera, pixels, {{100, 0}, {110, 0}, {110, 10}, {100, 10}}), 0);
}

TEST(SampleHistogram, CountsEveryColourInsideTheOutline) {
  const auto camera = camera_of(4, 4);
  std::vector<std::uint16_t> pixels(16);
  for (std::size_t i = 0; i < 16; ++i) pixels[i] = static_cast<std::uint16_t>(100 + i);
  pixels[5] = 5000;  // blue, above saturation
  // The outline holds the pixels of x and y from 0 to 1, one cell of the mosaic.
  const auto cell = sample_histogram(camera, pixels, {{-0.5, -0.5}, {1.5, -0.5}, {1.5, 1.5}, {-0.5, 1.5}});
  ASSERT_EQ(cell.counts[0].size(), 4096U);
  EXPECT_EQ(cell.counts[0][100], 1U);
  EXPECT_EQ(cell.counts[1][101], 1U);
  EXPECT_EQ(cell.counts[1][104], 1U);
  EXPECT_EQ(cell.counts[2].back(), 1U);
  const auto total = [](const SampleHistogram& h) {
    std::uint64_t sum = 0;
    for (const auto& list : h.counts) {
      for (const auto n : list) sum += n;
    }
    return sum;
  };
  EXPECT_EQ(total(cell), 4U);
  EXPECT_EQ(total(sample_histogram(camera, pixels, {})), 16U) << "without an outline, the whole image";
  EXPECT_EQ(total(sample_histogram(camera, pixels, {{50, 50}, {60, 50}, {60, 60}})), 0U);
}

TEST(Preview, IsSmallWhiteBalancedAndInSrgb) {
  auto camera = camera_of(1600, 1200);
  camera.white_balance = {2, 1, 4};
  // Half of the way from black to saturation in green, and what balances it in red and blue.
  std::vector<std::uint16_t> pixels(1600 * 1200);
  for (std::size_t y = 0; y < 1200; ++y) {
    for (std::size_t x = 0; x < 1600; ++x) {
      const auto colour = geometry::colour_at(camera.bayer, static_cast<int>(x), static_cast<int>(y));
      const double part = 0.5 / camera.white_balance[static_cast<std::size_t>(colour)];
      pixels[y * 1600 + x] = static_cast<std::uint16_t>(std::lround(64 + part * (4095 - 64)));
    }
  }
  const Preview preview = make_preview(camera, pixels, 400);
  EXPECT_EQ(preview.width, 400);
  EXPECT_EQ(preview.height, 300);
  ASSERT_EQ(preview.rgb.size(), 400U * 300 * 3);
  for (const std::uint8_t value : preview.rgb) ASSERT_NEAR(value, 188, 1);  // 0.5 in sRGB
  EXPECT_LE(make_preview(camera, pixels, 333).width, 333);
}

TEST(Preview, OfASensorWithoutColoursIsGrey) {
  auto camera = camera_of(8, 8);
  camera.bayer = geometry::BayerPattern::none;
  const Preview preview = make_preview(camera, std::vector<std::uint16_t>(64, 4095), 8);
  ASSERT_EQ(preview.rgb.size(), 4U * 4 * 3);
  for (const std::uint8_t value : preview.rgb) EXPECT_EQ(value, 255);
}

TEST(FramePool, GivesEverySlotToOneHolder) {
  const auto made = FramePool::make(3, 10);
  ASSERT_TRUE(made.has_value()) << made.error().text();
  FramePool& pool = **made;
  std::set<int> taken;
  for (int i = 0; i < 3; ++i) {
    const auto slot = pool.take();
    ASSERT_TRUE(slot.has_value());
    EXPECT_TRUE(taken.insert(slot->index).second);
    EXPECT_EQ(pool.pixels(*slot).size(), 10U);
    pool.pixels(*slot)[0] = static_cast<std::uint16_t>(slot->index + 1);
  }
  EXPECT_FALSE(pool.take().has_value());
  for (const int index : taken) EXPECT_EQ(pool.pixels({index})[0], index + 1);
  pool.release({1});
  const auto again = pool.take();
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->index, 1);
  pool.release({1});
  EXPECT_THROW(pool.release({1}), std::logic_error);
  EXPECT_THROW(pool.release({9}), std::out_of_range);
}

}  // namespace
}  // namespace rig::daemon
