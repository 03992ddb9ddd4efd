#include "sim/renderer.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/base/units.h"
#include "sim/chart.h"
#include "tests/core/seed.h"
#include "tests/sim/virtual_world.h"

namespace rig::sim {
namespace {

using base::radians;

// A diffuse patch where the camera's axis meets it. With pan p its normal is (sin p, 0, cos p), and that
// point (0, 0, offset / cos p); everything else is the law of irradiance.
TEST(Renderer, APatchHasTheRadianceOfTheClosedForm) {
  base::Random random(test::seed(61));
  for (int round = 0; round < 40; ++round) {
    World world = testing::small_world(16, 16, 1);
    world.sample_half_m = 0;
    world.tags.clear();
    world.light.aperture_m = 1e-6;
    world.light.arm_radius_m = random.uniform(0.5, 2);
    const double rho = random.uniform(0.05, 1);
    world.patches = {{0, 0, 0.15, 0.15, rho}};
    const double pan = round == 0 ? 0 : random.uniform(-0.8, 0.8);
    const double arm = round == 0 ? 0 : random.uniform(0.1, 1.5);
    const double arm_from_normal = arm - pan;
    if (std::abs(arm_from_normal) > 1.3) continue;
    const auto image = Renderer(world).render({0, 0, pan, arm});
    const double z = world.plane_offset_m / std::cos(pan);
    const double lx = world.light.arm_radius_m * std::sin(arm);
    const double lz = world.light.arm_radius_m * std::cos(arm) - z;
    const double r2 = lx * lx + lz * lz;
    const double cosine = (lx * std::sin(pan) + lz * std::cos(pan)) / std::sqrt(r2);
    const CameraWorld& c = world.camera;
    const double full_well = (c.saturation_dn - c.black_dn) * c.electrons_per_dn;
    const double white = full_well / c.white_fills_s * world.light.arm_radius_m * world.light.arm_radius_m;
    // The four pixels around the axis: R G / G B at even places.
    const double expected = white * rho * cosine / r2;
    const auto at = [&](int x, int y) { return image[static_cast<std::size_t>(y * 16 + x)]; };
    const double green = 0.5 * (at(8, 7) + at(7, 8));
    EXPECT_NEAR(green / expected, 1, 2e-3) << "round " << round << " pan " << pan << " arm " << arm;
    EXPECT_NEAR(at(8, 8) / (c.sensitivity[0] * expected), 1, 4e-3);
    EXPECT_NEAR(at(7, 7) / (c.sensitivity[2] * expected), 1, 4e-3);
  }
}

TEST(Renderer, ASourceOfSomeSizeGivesAsMuchAsItsCentre) {
  World world = testing::small_world(16, 16, 1);
  world.sample_half_m = 0;
  world.tags.clear();
  world.patches = {{0, 0, 0.15, 0.15, 0.5}};
  World point = world;
  point.light.aperture_m = 1e-6;
  const auto disc = Renderer(world).render({0, 0, 0, 0.6});
  const auto centre = Renderer(point).render({0, 0, 0, 0.6});
  for (std::size_t i = 0; i < disc.size(); ++i) EXPECT_NEAR(disc[i] / centre[i], 1, 2e-3);
}

TEST(Renderer, NothingIsSeenFromBehindOrInTheShade) {
  const World world = testing::small_world(32, 32, 5);
  for (const float v : Renderer(world).render({0, 0, radians(120), 0.5})) EXPECT_EQ(v, 0);
  // The light behind the plane of the sample.
  for (const float v : Renderer(world).render({0, 0, radians(-60), radians(100)})) EXPECT_EQ(v, 0);
}

TEST(Renderer, IsTheSameEveryTime) {
  const World world = testing::small_world(64, 48, 3);
  const Angles angles{0.1, 0.2, -0.1, 0.9};
  EXPECT_EQ(Renderer(world).render(angles), Renderer(world).render(angles));
}

// Pixels on ink are dark, pixels on the paper between the letters bright, line by line.
TEST(Renderer, TheTextOfTheChartIsThere) {
  const World world = testing::small_world(400, 300, 0.5);
  const auto image = Renderer(world).render({0, 0, 0, radians(35)});
  double ink = 0;
  double paper = 0;
  int inks = 0;
  int papers = 0;
  for (int y = 0; y < 300; ++y) {
    for (int x = (y & 1) == 0 ? 1 : 0; x < 400; x += 2) {  // green
      const double mm_x = (x - world.camera.cx) * 0.5;
      const double mm_y = (world.camera.cy - y) * 0.5;
      if (std::abs(mm_x) > 70 || mm_y < 63 || mm_y > 73) continue;  // the line of 8 mm
      // Pixels that lie wholly on one or the other.
      bool all_ink = true;
      bool none = true;
      for (const double dx : {-0.25, 0.0, 0.25}) {
        for (const double dy : {-0.25, 0.0, 0.25}) {
          const bool on = spot_at(mm_x + dx, mm_y + dy).region == 1;
          all_ink = all_ink && on;
          none = none && !on;
        }
      }
      const double value = image[static_cast<std::size_t>(y * 400 + x)];
      if (all_ink) {
        ink += value;
        ++inks;
      } else if (none) {
        paper += value;
        ++papers;
      }
    }
  }
  ASSERT_GT(inks, 100);
  ASSERT_GT(papers, 100);
  EXPECT_LT(ink / inks, 0.3 * paper / papers);
}

}  // namespace
}  // namespace rig::sim
