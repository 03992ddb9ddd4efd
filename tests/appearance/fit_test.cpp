// Fits of single texels against what is known: closed forms, recovery of parameters, degenerate input.
#include "appearance/fit.h"

#include <cmath>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/directions.h"

namespace rig::appearance {
namespace {

constexpr std::uint64_t kSeed = 20261;

geometry::Vec3 random_direction(base::Random& random) {
  return geometry::direction_from_polar({random.uniform(0, 1.1), random.uniform(-3.14159, 3.14159)});
}

std::vector<Sample> samples_of(const Lafortune& model, std::size_t count, double noise,
                               base::Random& random) {
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < count; ++i) {
    Sample s{random_direction(random), random_direction(random), {}, {}, false};
    // Half of them near the mirror direction, where a lobe shows.
    if (i % 2 == 0) {
      const auto m = geometry::mirrored(s.incident);
      s.exitant =
          geometry::normalized({m.x + random.uniform(-0.2, 0.2), m.y + random.uniform(-0.2, 0.2), m.z});
    }
    for (std::size_t c = 0; c < 3; ++c) {
      s.value[c] = evaluate(model, s.incident, s.exitant, c) * (1 + noise * random.normal());
      s.variance[c] = 1e-8;
    }
    samples.push_back(s);
  }
  return samples;
}

TEST(Lafortune, IsReciprocal) {
  base::Random random(kSeed);
  const Lafortune model{{0.1, 0.2, 0.05}, {0.5, 0.4, 0.3}, -0.9, -1.0, 0.8, 12};
  for (int i = 0; i < 1000; ++i) {
    const auto a = random_direction(random);
    const auto b = random_direction(random);
    EXPECT_DOUBLE_EQ(evaluate(model, a, b, 1), evaluate(model, b, a, 1));
  }
}

TEST(FitDiffuse, OfAConstantBrdfIsThatConstant) {
  base::Random random(kSeed + 1);
  const Lafortune model{{0.1, 0.2, 0.05}, {}, -1, -1, 1, 10};
  const Fit fit = fit_diffuse(samples_of(model, 40, 0, random));
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(fit.model.rho_d[c], model.rho_d[c], 1e-12);
  EXPECT_NEAR(fit.residual, 0, 1e-12);
  EXPECT_EQ(fit.count, 40);
}

TEST(FitLafortune, RecoversIsotropicAndAnisotropicLobes) {
  for (int trial = 0; trial < 20; ++trial) {
    base::Random random(kSeed + 100 + static_cast<std::uint64_t>(trial));
    const Lafortune model{{random.uniform(0.02, 0.2), random.uniform(0.02, 0.2), random.uniform(0.02, 0.2)},
                          {0.5, 0.6, 0.4},
                          -1,
                          random.uniform(-1, -0.7),
                          random.uniform(0.8, 1),
                          random.uniform(6, 40)};
    const auto samples = samples_of(model, 90, 0, random);
    const Fit fit = fit_lafortune(samples);
    for (const Sample& s : samples) {
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(evaluate(fit.model, s.incident, s.exitant, c), s.value[c], 0.02 * s.value[c] + 1e-3)
            << "seed " << kSeed + 100 + static_cast<std::uint64_t>(trial);
      }
    }
  }
}

TEST(FitLafortune, ExplainsNoisyGlossBetterThanDiffuse) {
  base::Random random(kSeed + 2);
  const Lafortune model{{0.05, 0.05, 0.05}, {1, 1, 1}, -1, -1, 1, 20};
  const auto samples = samples_of(model, 70, 0.02, random);
  EXPECT_LT(fit_lafortune(samples).residual, 0.2 * fit_diffuse(samples).residual);
}

TEST(FitLafortune, IsFiniteForDegenerateInput) {
  const geometry::Vec3 up{0, 0, 1};
  const std::vector<Sample> dark(30, Sample{up, up, {0, 0, 0}, {0, 0, 0}, false});
  const std::vector<Sample> same(30, Sample{up, up, {0.3, 0.2, 0.1}, {1e-6, 1e-6, 1e-6}, false});
  const std::vector<Sample> wild{30, Sample{up, up, {1e9, 0, -1e9}, {1, 1, 1}, false}};
  for (const auto& samples : {std::vector<Sample>{}, std::vector<Sample>{same.front()}, dark, same, wild}) {
    const Fit fit = fit_lafortune(samples);
    EXPECT_EQ(fit.count, static_cast<int>(samples.size()));
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_TRUE(std::isfinite(fit.model.rho_d[c]) && fit.model.rho_d[c] >= 0);
      EXPECT_TRUE(std::isfinite(fit.model.rho_s[c]) && fit.model.rho_s[c] >= 0);
    }
    EXPECT_TRUE(std::isfinite(fit.model.n) && std::isfinite(fit.residual));
  }
}

TEST(FitLafortune, AFewViewsFromOneSideMakeNoWildLobe) {
  // A flash beside the camera: eight views within 25 degrees of the normal, as of a glossy card by hand.
  base::Random random(kSeed + 3);
  const Lafortune model{{0.02, 0.05, 0.05}, {0.4, 0.4, 0.4}, -1, -1, 1, 60};
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Sample> samples;
    double highest = 0;
    for (int i = 0; i < 8; ++i) {
      const auto d =
          geometry::direction_from_polar({random.uniform(0, 0.43), random.uniform(-3.14159, 3.14159)});
      Sample s{d, d, {}, {}, false};
      for (std::size_t c = 0; c < 3; ++c) {
        s.value[c] = evaluate(model, d, d, c) * (1 + 0.05 * random.normal());
        s.variance[c] = 1e-6;
        highest = std::max(highest, s.value[c]);
      }
      samples.push_back(s);
    }
    const Fit fit = fit_lafortune(samples);
    for (int i = 0; i < 100; ++i) {
      const auto wi = random_direction(random);
      const auto wr = random_direction(random);
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_LT(evaluate(fit.model, wi, wr, c), 100 * highest)
            << "trial " << trial << ", seed " << kSeed + 3;
    }
  }
}

TEST(FitLafortune, SaturatedSamplesAreLowerBounds) {
  base::Random random(kSeed + 4);
  const Lafortune model{{0.05, 0.05, 0.05}, {1, 1, 1}, -1, -1, 1, 20};
  const auto whole = samples_of(model, 90, 0, random);
  auto clipped = whole;
  auto bounded = whole;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (whole[i].value[1] < 0.6) continue;
    clipped[i].value = bounded[i].value = {0.6, 0.6, 0.6};
    bounded[i].at_least = true;
  }
  const geometry::Vec3 up{0, 0, 1};
  const double truth = evaluate(model, up, up, 1);
  EXPECT_LT(evaluate(fit_lafortune(clipped).model, up, up, 1), 0.75 * truth);
  EXPECT_NEAR(evaluate(fit_lafortune(bounded).model, up, up, 1), truth, 0.05 * truth);
}

}  // namespace
}  // namespace rig::appearance
