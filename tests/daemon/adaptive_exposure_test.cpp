// The adaptive strategy against closed forms, against a search over all brackets, and in random scenes.
#include "daemon/adaptive_exposure.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "core/base/random.h"
#include "tests/core/seed.h"

namespace rig::daemon {
namespace {

const geometry::SensorModel kSensor{12, 64, 4095, 8, 6};

// Electrons per second of every pixel, one colour a third of them.
using Rates = std::array<std::vector<double>, 3>;

SeenFrame photograph(const Rates& dn_s, double exposure_s, base::Random* noise) {
  auto histogram = std::make_shared<SampleHistogram>();
  for (std::size_t c = 0; c < 3; ++c) {
    histogram->counts[c].resize(4096);
    for (const double rate : dn_s[c]) {
      const double signal = rate * exposure_s;
      const double off = noise == nullptr ? 0 : noise->normal() * std::sqrt(kSensor.variance_dn2(signal));
      const double value = std::clamp(std::round(64 + signal + off), 0.0, 4095.0);
      ++histogram->counts[c][static_cast<std::size_t>(value)];
    }
  }
  return {exposure_s, histogram};
}

Rates random_scene(base::Random& random, double span) {
  Rates rates;
  const double middle = std::exp(random.uniform(std::log(50.0), std::log(2e4)));
  for (auto& list : rates) {
    for (int i = 0; i < 300; ++i) list.push_back(middle * std::exp(random.uniform(-span, span)));
  }
  return rates;
}

AdaptiveRequest request_of(std::size_t frames) {
  return {kSensor, 5e-5, 2, 0.5, frames, 20, 0.01};
}

struct Bracket {
  std::vector<SeenFrame> frames;
  std::vector<double> exposures_s;
};

Bracket take(const Rates& scene, AdaptiveRequest request, double first_s, base::Random* noise) {
  Bracket bracket;
  std::optional<double> next = first_s;
  while (next) {
    bracket.exposures_s.push_back(*next);
    bracket.frames.push_back(photograph(scene, *next, noise));
    --request.frames_left;
    next = next_adaptive_s(request, bracket.frames);
  }
  return bracket;
}

TEST(MergedSnr, IsTheClosedFormOfOneFrameAndOfMany) {
  // 100 above black are 800 electrons: sqrt(800 + 36 + 64 / 12) of noise.
  const Brightness pixel{100, 100, 1};
  const double one = 800 / std::sqrt(800 + 36 + 64.0 / 12);
  EXPECT_NEAR(merged_snr(kSensor, pixel, {1}), one, 1e-9);
  EXPECT_NEAR(merged_snr(kSensor, pixel, {1, 1, 1, 1}), 2 * one, 1e-9) << "four alike are twice as good";
  const double half = 400 / std::sqrt(400 + 36 + 64.0 / 12);
  EXPECT_NEAR(merged_snr(kSensor, pixel, {1, 0.5}), std::hypot(one, half), 1e-9);
  EXPECT_NEAR(merged_snr(kSensor, pixel, {1, 100}), one, 1e-9) << "a saturated frame adds nothing";
}

TEST(SceneOf, TakesTheBrightFromTheShorterFrame) {
  Rates rates;
  rates[0] = std::vector<double>(60, 1000);
  rates[1] = std::vector<double>(30, 100000);
  rates[2] = std::vector<double>(10, 1e9);
  const Scene scene = scene_of(kSensor, {photograph(rates, 1, nullptr), photograph(rates, 0.01, nullptr)});
  ASSERT_EQ(scene.known.size(), 2U);
  EXPECT_NEAR(scene.known[0].low_dn_s, 1000, 1);
  EXPECT_NEAR(scene.known[0].share, 0.6, 1e-12);
  EXPECT_NEAR(scene.known[1].high_dn_s, 100000, 100);
  EXPECT_NEAR(scene.known[1].share, 0.3, 1e-12);
  EXPECT_NEAR(scene.saturated_share, 0.1, 1e-12);
  EXPECT_NEAR(share_short(kSensor, 20, scene, {1, 0.01}), 0.1, 1e-12);
  EXPECT_EQ(scene_of(kSensor, {{1, nullptr}}).known.size(), 0U);
}

TEST(NextAdaptive, OneBrightnessTakesTheShortestThatDoes) {
  Rates rates;
  for (auto& list : rates) list = std::vector<double>(100, 500);
  AdaptiveRequest request = request_of(1);
  const auto next = next_adaptive_s(request, {photograph(rates, 0.01, nullptr)});
  ASSERT_TRUE(next.has_value());
  const Brightness pixel{500, 500, 1};
  EXPECT_GE(merged_snr(kSensor, pixel, {0.01, *next}), 20);
  EXPECT_LT(merged_snr(kSensor, pixel, {0.01, *next * std::exp2(-0.25)}), 20)
      << "a quarter stop less would not";
}

// Every bracket of up to two further exposures on the same steps, frame by frame through merged_snr.
TEST(NextAdaptive, TakesTheLeastTimeOfAllBrackets) {
  base::Random random(test::seed(300));
  int reached = 0;
  for (int round = 0; round < 40; ++round) {
    const Rates rates = random_scene(random, random.uniform(0.2, 3));
    const AdaptiveRequest request = request_of(2);
    const std::vector<SeenFrame> frames{photograph(rates, 5e-5, nullptr), photograph(rates, 0.02, nullptr)};
    const Scene scene = scene_of(kSensor, frames);
    std::vector<double> steps;
    for (double s = request.longest_s; s > request.shortest_s; s *= std::exp2(-0.25)) steps.push_back(s);
    steps.push_back(request.shortest_s);
    const double now = share_short(kSensor, request.snr, scene, {5e-5, 0.02});
    double least_s = std::numeric_limits<double>::infinity();
    double fewest = now;
    const auto consider = [&](const std::vector<double>& more) {
      std::vector<double> all{5e-5, 0.02};
      double seconds = 0;
      for (const double s : more) {
        all.push_back(s);
        seconds += s + request.readout_s;
      }
      const double share = share_short(kSensor, request.snr, scene, all);
      fewest = std::min(fewest, share);
      if (share <= request.short_share) least_s = std::min(least_s, seconds);
    };
    for (const double a : steps) {
      consider({a});
      for (const double b : steps) consider({a, b});
    }
    const auto first = next_adaptive_s(request, frames);
    if (now <= request.short_share) {
      EXPECT_FALSE(first.has_value());
      continue;
    }
    if (fewest >= now - 1e-9) {
      EXPECT_FALSE(first.has_value()) << "nothing helps";
      continue;
    }
    ASSERT_TRUE(first.has_value()) << "round " << round;
    // With the first one taken, the best second one must lead to what the search found.
    double best_s = std::numeric_limits<double>::infinity();
    double best_share = share_short(kSensor, request.snr, scene, {5e-5, 0.02, *first});
    if (best_share <= request.short_share) best_s = *first + request.readout_s;
    for (const double b : steps) {
      const double share = share_short(kSensor, request.snr, scene, {5e-5, 0.02, *first, b});
      best_share = std::min(best_share, share);
      if (share <= request.short_share) best_s = std::min(best_s, *first + b + 2 * request.readout_s);
    }
    if (std::isfinite(least_s)) {
      ++reached;
      EXPECT_NEAR(best_s, least_s, 1e-9) << "round " << round;
    } else {
      EXPECT_NEAR(best_share, fewest, 1e-9) << "round " << round;
    }
  }
  EXPECT_GT(reached, 8);
}

TEST(AdaptiveBrackets, KeepEveryBound) {
  base::Random random(test::seed(301));
  int satisfied = 0;
  for (int round = 0; round < 150; ++round) {
    const Rates rates = random_scene(random, random.uniform(0.1, 4));
    AdaptiveRequest request = request_of(1 + random.below(6));
    request.longest_s = std::exp(random.uniform(std::log(0.01), std::log(2.0)));
    request.snr = random.uniform(2, 60);
    const double first_s = std::max(request.shortest_s, request.longest_s * random.uniform(0.001, 1));
    const Bracket bracket = take(rates, request, first_s, &random);
    EXPECT_LE(bracket.exposures_s.size(), request.frames_left);
    for (const double s : bracket.exposures_s) {
      EXPECT_LE(s, request.longest_s);
      EXPECT_GE(s, request.shortest_s);
    }
    const Scene scene = scene_of(kSensor, bracket.frames);
    // Saturated in every frame are more than asked only where the shortest exposure could not avoid it.
    if (scene.saturated_share > request.short_share && request.frames_left > 1) {
      const SeenFrame darkest = photograph(rates, request.shortest_s, nullptr);
      std::uint64_t saturated = 0;
      for (const auto& list : darkest.histogram->counts) saturated += list.back();
      EXPECT_GT(static_cast<double>(saturated) / 900, 0.5 * request.short_share) << "round " << round;
    }
    if (share_short(kSensor, request.snr, scene, bracket.exposures_s) <= request.short_share) ++satisfied;
  }
  EXPECT_GT(satisfied, 20);
}

TEST(AdaptiveBrackets, AskForMoreTimeWhereMoreIsAsked) {
  base::Random random(test::seed(302));
  for (int round = 0; round < 30; ++round) {
    const Rates rates = random_scene(random, random.uniform(0.1, 2));
    const std::vector<SeenFrame> frames{photograph(rates, 5e-5, nullptr), photograph(rates, 0.02, nullptr)};
    const Scene scene = scene_of(kSensor, frames);
    double before = 0;
    for (const double snr : {1.0, 5.0, 20.0, 50.0, 100.0}) {
      const double share = share_short(kSensor, snr, scene, {5e-5, 0.02});
      EXPECT_GE(share, before);
      before = share;
    }
    // One frame, one brightness: the exposure grows with the ratio.
    Rates flat;
    for (auto& list : flat) list = std::vector<double>(10, rates[0][0]);
    double exposure = 0;
    for (const double snr : {2.0, 4.0, 8.0, 16.0, 32.0}) {
      AdaptiveRequest request = request_of(1);
      request.snr = snr;
      const auto next = next_adaptive_s(request, {photograph(flat, 5e-5, nullptr)});
      if (!next) continue;
      EXPECT_GE(*next, exposure);
      exposure = *next;
    }
  }
}

TEST(AdaptiveBrackets, ReachTheRatioInANoisyNight) {
  base::Random random(test::seed(303));
  // A range of 50 that one or two exposures of a 12 bit sensor can hold.
  for (int round = 0; round < 20; ++round) {
    Rates rates;
    for (auto& list : rates) {
      for (int i = 0; i < 300; ++i) list.push_back(1000 * std::exp(random.uniform(0, std::log(50.0))));
    }
    AdaptiveRequest request = request_of(5);
    const Bracket bracket = take(rates, request, 0.01, &random);
    std::size_t good = 0;
    for (const auto& list : rates) {
      for (const double rate : list) {
        if (merged_snr(kSensor, {rate, rate, 1}, bracket.exposures_s) >= 0.95 * request.snr) ++good;
      }
    }
    EXPECT_GE(good, 900 * 98 / 100) << "round " << round;
    EXPECT_LE(bracket.exposures_s.size(), 4U);
  }
}

}  // namespace
}  // namespace rig::daemon
