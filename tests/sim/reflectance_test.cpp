// The materials of the virtual rig: what any reflectance has to be, and what theirs says in closed form.
#include <algorithm>
#include <gtest/gtest.h>
#include <set>

#include "core/base/random.h"
#include "sim/chart.h"
#include "sim/font.h"
#include "sim/sgd.h"
#include "sim/thread_model.h"
#include "tests/core/seed.h"

namespace rig::sim {
namespace {

V3 direction(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

V3 any_direction(base::Random& random, double to_theta = 1.55) {
  return direction(random.uniform(0, to_theta), random.uniform(-kPi, kPi));
}

// Share of the light from `wi` that is reflected at all. The midpoint rule is fine for lobes this wide.
template <typename Brdf>
double albedo(const Brdf& brdf, V3 wi) {
  constexpr int kThetas = 180;
  constexpr int kPhis = 180;
  double sum = 0;
  for (int i = 0; i < kThetas; ++i) {
    const double theta = (i + 0.5) / kThetas * kPi / 2;
    for (int j = 0; j < kPhis; ++j) {
      const double phi = (j + 0.5) / kPhis * 2 * kPi;
      sum += brdf(wi, direction(theta, phi)) * std::cos(theta) * std::sin(theta);
    }
  }
  return sum * (kPi / 2 / kThetas) * (2 * kPi / kPhis);
}

template <typename Check>
void for_every_channel(const Check& check) {
  for (const SgdMaterial& material : sgd_materials()) {
    for (std::size_t c = 0; c < 3; ++c) {
      SCOPED_TRACE(material.name + " channel " + std::to_string(c));
      check(material.rgb[c]);
    }
  }
}

TEST(Sgd, IsReciprocalPositiveAndDarkBelowTheHorizon) {
  base::Random random(test::seed(21));
  for_every_channel([&](const SgdChannel& m) {
    for (int i = 0; i < 300; ++i) {
      const V3 a = any_direction(random);
      const V3 b = any_direction(random);
      const double f = sgd_brdf(m, a, b);
      EXPECT_GE(f, 0);
      EXPECT_TRUE(std::isfinite(f));
      EXPECT_NEAR(f, sgd_brdf(m, b, a), 1e-12 * std::max(1.0, f));
      EXPECT_EQ(sgd_brdf(m, a, {b.x, b.y, -b.z}), 0);
      EXPECT_EQ(sgd_brdf(m, {a.x, a.y, -a.z}, b), 0);
    }
  });
}

TEST(Sgd, IsIsotropic) {
  base::Random random(test::seed(22));
  for_every_channel([&](const SgdChannel& m) {
    const V3 a = any_direction(random, 1.2);
    const V3 b = any_direction(random, 1.2);
    const double turn = random.uniform(-kPi, kPi);
    const double f = sgd_brdf(m, a, b);
    EXPECT_NEAR(sgd_brdf(m, turned(a, {0, 0, 1}, turn), turned(b, {0, 0, 1}, turn)), f, 1e-9 * f);
  });
}

TEST(Sgd, ReflectsLessThanItReceives) {
  for_every_channel([&](const SgdChannel& m) {
    for (const double theta : {0.0, 0.5, 1.0}) {
      const double a = albedo([&](V3 i, V3 r) { return sgd_brdf(m, i, r); }, direction(theta, 0.3));
      EXPECT_LT(a, 1) << theta;
      EXPECT_GT(a, 0.7 * m.rho_d) << theta;
    }
  });
}

TEST(Sgd, ShinesInTheMirrorDirection) {
  for_every_channel([&](const SgdChannel& m) {
    if (m.alpha > 0.15 || m.rho_s < 0.05) return;  // too rough to show
    for (const double theta : {0.3, 0.6, 0.9}) {
      const V3 wi = direction(theta, 0);
      const double mirror = sgd_brdf(m, wi, direction(theta, kPi));
      for (const double away : {0.2, 0.4, 0.8, 2.0}) {
        EXPECT_GT(mirror, sgd_brdf(m, wi, direction(theta, kPi + away))) << theta << ' ' << away;
      }
    }
  });
}

// Along the normal F, D and G are numbers: F = f0 - f1, D = kappa exp(-alpha) / (pi alpha^p), G = 1 where
// shadowing begins beyond the normal.
TEST(Sgd, HasItsClosedFormAlongTheNormal) {
  int checked = 0;
  for_every_channel([&](const SgdChannel& m) {
    if (m.theta0 < 0) return;
    ++checked;
    const double d = m.kap * std::exp(-m.alpha) / (kPi * std::pow(m.alpha, m.p));
    const double f = (m.rho_d + m.rho_s * (m.f0 - m.f1) * d) / kPi;
    EXPECT_NEAR(sgd_brdf(m, {0, 0, 1}, {0, 0, 1}), f, 1e-9 * f);
    EXPECT_NEAR(sgd_brdf(m, {0, 0, 1}, {0, 0, 1}, 0.25), f - 0.75 * m.rho_d / kPi, 1e-9 * f);
  });
  EXPECT_GT(checked, 10);
}

TEST(Threads, AreReciprocalPositiveAndDarkBelowTheHorizon) {
  base::Random random(test::seed(23));
  for (const Thread& thread : threads()) {
    for (int i = 0; i < 500; ++i) {
      const V3 a = any_direction(random);
      const V3 b = any_direction(random);
      const double angle = random.uniform(0, kPi);
      const V3 tangent{std::cos(angle), std::sin(angle), 0};
      for (int c = 0; c < 3; ++c) {
        const double f = thread_brdf(thread, tangent, a, b, c);
        EXPECT_GT(f, 0);
        EXPECT_NEAR(f, thread_brdf(thread, tangent, b, a, c), 1e-12 * std::max(1.0, f));
        EXPECT_EQ(thread_brdf(thread, tangent, a, {b.x, b.y, -b.z}, c), 0);
      }
    }
  }
}

// Light that comes in along a thread leaves on the cone opposite, not back where it came from; light that
// comes in across it goes around the thread to both sides alike.
TEST(Threads, AreAnisotropic) {
  for (const Thread& thread : threads()) {
    const V3 wi = direction(0.6, 0);
    const V3 mirror = direction(0.6, kPi);
    const V3 along{1, 0, 0};
    const V3 across{0, 1, 0};
    EXPECT_GT(thread_brdf(thread, along, wi, mirror, 0), 1.2 * thread_brdf(thread, along, wi, wi, 0));
    EXPECT_LE(thread_brdf(thread, across, wi, mirror, 0), thread_brdf(thread, across, wi, wi, 0));
  }
}

TEST(Threads, TurnWithTheirTangent) {
  base::Random random(test::seed(24));
  for (int i = 0; i < 200; ++i) {
    const V3 a = any_direction(random);
    const V3 b = any_direction(random);
    const double turn = random.uniform(-kPi, kPi);
    const V3 up{0, 0, 1};
    const double f = thread_brdf(threads()[1], {1, 0, 0}, a, b, 1);
    const double g =
        thread_brdf(threads()[1], turned({1, 0, 0}, up, turn), turned(a, up, turn), turned(b, up, turn), 1);
    EXPECT_NEAR(f, g, 1e-9 * f);
  }
}

TEST(Threads, ReflectLessThanTheyReceive) {
  for (const Thread& thread : threads()) {
    for (int c = 0; c < 3; ++c) {
      for (const double theta : {0.0, 0.5, 1.0, 1.4}) {
        for (const double phi : {0.0, 0.7, kPi / 2}) {
          const double a = albedo(
              [&](V3 i, V3 r) {
                return thread_brdf(thread, {1, 0, 0}, i, r, c);
              },
              direction(theta, phi));
          EXPECT_LT(a, 1) << theta << ' ' << phi;
          EXPECT_GT(a, 0.01);
        }
      }
    }
  }
}

TEST(Font, DrawsLettersAsTheyAre) {
  // An L of 7 mm: cells of 1 mm, a stem at the left and a foot below.
  for (int row = 0; row < 7; ++row) EXPECT_TRUE(inked("L", 7, 0.5, row + 0.5)) << row;
  for (int column = 0; column < 5; ++column) EXPECT_TRUE(inked("L", 7, column + 0.5, 0.5)) << column;
  for (int row = 1; row < 7; ++row) EXPECT_FALSE(inked("L", 7, 3.5, row + 0.5)) << row;
  EXPECT_FALSE(inked("L", 7, -0.5, 3));
  EXPECT_FALSE(inked("L", 7, 0.5, 7.5));
  EXPECT_FALSE(inked("L L", 7, 6.5, 3.5));
  EXPECT_TRUE(inked("L L", 7, 12.5, 3.5));
}

TEST(Chart, HasItsTextAndEveryRegion) {
  std::set<int> regions;
  int ink_in_text = 0;
  int paper_in_text = 0;
  int ink_elsewhere = 0;
  for (double y = -79.9; y < 80; y += 0.2) {
    for (double x = -79.9; x < 80; x += 0.2) {
      const Spot spot = spot_at(x, y);
      regions.insert(spot.region);
      const bool ink = spot.region == 1;
      if (y > 46.5 && y < 72.5) {
        (ink ? ink_in_text : paper_in_text) += 1;
      } else {
        ink_elsewhere += ink ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(regions.size(), region_names().size());
  EXPECT_EQ(*regions.begin(), 0);
  EXPECT_EQ(ink_elsewhere, 0);
  EXPECT_GT(ink_in_text, 0.1 * paper_in_text);
  EXPECT_LT(ink_in_text, 0.7 * paper_in_text);
  EXPECT_EQ(spot_at(-68.5, 68).region, 1);  // the stem of the first line's R
  EXPECT_EQ(region_names()[1].substr(0, 3), "ink");
}

TEST(Chart, GivesEverySpotAnAlbedoBelowOne) {
  for (double y = -79; y < 80; y += 3) {
    for (double x = -79; x < 80; x += 3) {
      const Spot spot = spot_at(x, y);
      for (const double a : spot_albedo(spot)) {
        EXPECT_GE(a, 0);
        EXPECT_LT(a, 1);
      }
      EXPECT_GT(spot_alpha(spot), 0);
      EXPECT_GT(spot_brdf(spot, {0, 0, 1}, {0, 0, 1}, 1), 0);
    }
  }
}

}  // namespace
}  // namespace rig::sim
