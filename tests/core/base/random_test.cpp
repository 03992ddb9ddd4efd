// Statistics of the random numbers. The keys are fixed, so that a test that passes always passes; the bounds
// are five standard deviations of the statistic, which a sound generator exceeds once in two million keys.
#include "core/base/random.h"

#include <array>
#include <gtest/gtest.h>
#include <set>
#include <vector>

namespace rig::base {
namespace {

constexpr int kDraws = 200'000;

TEST(Random, AKeyDeterminesTheSequence) {
  Random a(7);
  Random b(7);
  Random c(8);
  int same = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto bits = a.bits();
    EXPECT_EQ(bits, b.bits());
    same += bits == c.bits() ? 1 : 0;
  }
  EXPECT_EQ(same, 0);
}

TEST(Random, ValuesNeverChange) {
  // Simulated frames are compared byte for byte across versions: these values are part of the format.
  EXPECT_EQ(mix64(0), 0xe220a8397b1dcdafULL) << "first output of SplitMix64 from state 0";
  static_assert(unit_from_bits(~0ULL) < 1.0);
  static_assert(unit_from_bits(0) == 0.0);
}

TEST(Random, UniformHasItsMeanVarianceAndFlatHistogram) {
  Random random(1);
  constexpr int kBins = 100;
  std::array<int, kBins> counts{};
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    sum += u;
    squares += (u - 0.5) * (u - 0.5);
    ++counts[static_cast<std::size_t>(u * kBins)];
  }
  EXPECT_NEAR(sum / kDraws, 0.5, 5 * std::sqrt(1.0 / 12 / kDraws));
  EXPECT_NEAR(squares / kDraws, 1.0 / 12, 5 * std::sqrt(1.0 / 180 / kDraws));
  double chi_square = 0;
  constexpr double kExpected = static_cast<double>(kDraws) / kBins;
  for (const int n : counts) chi_square += (n - kExpected) * (n - kExpected) / kExpected;
  // Mean of the chi-square distribution is its 99 degrees of freedom, variance twice that.
  EXPECT_NEAR(chi_square, kBins - 1, 5 * std::sqrt(2.0 * (kBins - 1)));
}

TEST(Random, NormalHasTheMomentsOfTheNormalDistribution) {
  Random random(2);
  std::array<double, 5> moments{};
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.normal();
    ASSERT_TRUE(std::isfinite(x));
    double power = 1;
    for (double& moment : moments) {
      moment += power / kDraws;
      power *= x;
    }
  }
  // Variances of x, x^2, x^3, x^4 are 1, 2, 15, 96.
  EXPECT_NEAR(moments[1], 0, 5 * std::sqrt(1.0 / kDraws));
  EXPECT_NEAR(moments[2], 1, 5 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(moments[3], 0, 5 * std::sqrt(15.0 / kDraws));
  EXPECT_NEAR(moments[4], 3, 5 * std::sqrt(96.0 / kDraws));
}

TEST(Random, BelowReachesEveryNumberAndNoOther) {
  Random random(3);
  std::set<std::uint64_t> seen;
  for (int i = 0; i < 1000; ++i) seen.insert(random.below(7));
  EXPECT_EQ(seen, (std::set<std::uint64_t>{0, 1, 2, 3, 4, 5, 6}));
}

// Streams of neighbouring keys are what pixels and poses draw from: they must not resemble each other.
TEST(Random, NeighbouringStreamsAreUncorrelated) {
  constexpr std::uint64_t kKey = 42;
  double product = 0;
  for (std::uint64_t i = 0; i < kDraws; ++i) {
    Random a(derive_key(kKey, i));
    Random b(derive_key(kKey, i + 1));
    product += (a.uniform() - 0.5) * (b.uniform() - 0.5);
  }
  // The product of two independent centred uniforms has variance 1/144.
  EXPECT_NEAR(product / kDraws, 0, 5 * std::sqrt(1.0 / 144 / kDraws));
}

TEST(Random, OneBitOfTheKeyTurnsHalfTheBitsOver) {
  double turned = 0;
  constexpr int kTries = 2000;
  for (std::uint64_t i = 0; i < kTries; ++i) {
    const std::uint64_t change = derive_key(i, 5) ^ derive_key(i ^ (1ULL << (i % 64)), 5);
    turned += __builtin_popcountll(change);
  }
  EXPECT_NEAR(turned / kTries, 32, 5 * std::sqrt(16.0 / kTries));
}

}  // namespace
}  // namespace rig::base
