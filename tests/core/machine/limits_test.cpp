// The one place that says whether a motion is allowed: nothing gets past it, and it does not forbid what is
// free.
#include "core/machine/limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

#include "core/base/random.h"
#include "core/base/units.h"
#include "core/machine/kinematics.h"
#include "core/machine/motion.h"
#include "tests/core/machine/rig_file.h"
#include "tests/core/seed.h"

namespace rig::machine {
namespace {

using base::radians;
using geometry::Vec3;
using testing::HasSubstr;

JointAngles random_angles(const RigConfig& rig, base::Random& random) {
  JointAngles angles{};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    angles[i] = random.uniform(rig.axes[i].min_rad, rig.axes[i].max_rad);
  }
  return angles;
}

// Free distance of a rule, from points spread over the bodies and not from the code under test; never less
// than the true one.
double sampled_clearance(const RigConfig& rig, const KeepOut& rule, const JointAngles& angles) {
  const auto centre = [&](const std::string& body) {
    return body == "light" ? light_in_bench(rig.light, angles) : camera_in_bench(rig.camera);
  };
  const auto radius = [&](const std::string& body) {
    return body == "light" ? rig.bodies.light_radius_m : rig.bodies.camera_radius_m;
  };
  if (rule.first != "carrier" && rule.second != "carrier") {
    return geometry::length(centre(rule.first) - centre(rule.second)) - radius(rule.first) -
           radius(rule.second);
  }
  const std::string& sphere = rule.first == "carrier" ? rule.second : rule.first;
  const auto carrier = bench_from_sample(rig.carrier, angles);
  const Vec3 seen = geometry::inverse(carrier).point(centre(sphere));
  double nearest = std::numeric_limits<double>::infinity();
  // The rim and spokes towards the sphere are where the nearest point of a disc is.
  const double azimuth = std::atan2(seen.y, seen.x);
  for (int k = 0; k <= 400; ++k) {
    const double r = rig.bodies.carrier_radius_m * k / 400.0;
    nearest =
        std::min(nearest, geometry::length(seen - Vec3{r * std::cos(azimuth), r * std::sin(azimuth), 0}));
  }
  return nearest - radius(sphere);
}

TEST(AxisLimit, BothEndsAreAllowedAndNothingBeyond) {
  const RigConfig rig = rig_with({});
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const auto axis = static_cast<AxisId>(i);
    const double inf = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(check_axis_limit(rig, axis, rig.axes[i].min_rad).has_value());
    EXPECT_TRUE(check_axis_limit(rig, axis, rig.axes[i].max_rad).has_value());
    EXPECT_FALSE(check_axis_limit(rig, axis, std::nextafter(rig.axes[i].min_rad, -inf)).has_value());
    EXPECT_FALSE(check_axis_limit(rig, axis, std::nextafter(rig.axes[i].max_rad, inf)).has_value());
    EXPECT_FALSE(check_axis_limit(rig, axis, std::nan("")).has_value());
    EXPECT_FALSE(check_axis_limit(rig, axis, inf).has_value());
    EXPECT_FALSE(check_axis_limit(rig, axis, -inf).has_value());
  }
  const auto refused = check_axis_limit(rig, AxisId::arm, radians(5));
  EXPECT_EQ(refused.error().code, base::ErrorCode::refused);
  EXPECT_EQ(refused.error().what,
            "axis arm may not go to 5.0000 deg: its limits are 10.0000 to 175.0000 deg");
}

TEST(CheckStanding, OneBadAxisIsEnough) {
  const RigConfig rig = rig_with({});
  const JointAngles good{0, 0, 0, radians(45)};
  EXPECT_TRUE(check_standing(rig, good).has_value());
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    for (const double bad : {std::nan(""), 100.0, -100.0}) {
      JointAngles angles = good;
      angles[i] = bad;
      EXPECT_FALSE(check_standing(rig, angles).has_value()) << kAxisNames[i] << " " << bad;
      EXPECT_FALSE(check_move(rig, good, angles).has_value()) << kAxisNames[i] << " " << bad;
    }
  }
}

TEST(CheckStanding, AgreesWithTheBodiesSampled) {
  const RigConfig rig = cramped_rig();
  base::Random random(test::seed(60));
  int allowed = 0;
  int refused = 0;
  for (int i = 0; i < 5000; ++i) {
    const JointAngles angles = random_angles(rig, random);
    double margin = std::numeric_limits<double>::infinity();
    for (const KeepOut& rule : rig.keep_out) {
      margin = std::min(margin, sampled_clearance(rig, rule, angles) - rule.clearance_m);
    }
    const bool stands = check_standing(rig, angles).has_value();
    (stands ? allowed : refused) += 1;
    if (stands) {
      EXPECT_GE(margin, 0);
    } else {
      EXPECT_LE(margin, 0.0005) << "the samples on the disc are at most 0.4 mm apart";
    }
  }
  EXPECT_GT(allowed, 500) << "the rig is no test if it forbids everything";
  EXPECT_GT(refused, 500) << "or nothing";
}

TEST(CheckStanding, SaysWhichBodiesAndHowFar) {
  const RigConfig rig = rig_with({{"min_deg = 10.0", "min_deg = 0.0"}});
  // At 0 deg light and camera are 225.4 mm apart between centres, 75.4 mm between surfaces.
  EXPECT_TRUE(check_standing(rig, {0, 0, 0, 0}).has_value());
  const RigConfig strict =
      rig_with({{"min_deg = 10.0", "min_deg = 0.0"}, {"clearance_mm = 30.0", "clearance_mm = 76.0"}});
  const auto refused = check_standing(strict, {0, 0, 0, 0});
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().what,
              HasSubstr("keep-out 'light and camera': light and camera would be 75.4 mm apart"));
  EXPECT_THAT(refused.error().what, HasSubstr("at least 76.0 mm are required"));
}

TEST(CheckStanding, OverTheFaceOfTheCarrierTheHeightCounts) {
  RigConfig rig = rig_with({{"arm_radius_mm = 1000.0", "arm_radius_mm = 260.0"}});
  // Straight over the centre: 260 mm less the plane's offset and the light's radius.
  const JointAngles facing{0, 0, radians(45), radians(45)};
  rig.keep_out[1].clearance_m = 0.260 - 0.0254 - 0.060 - 1e-9;
  EXPECT_TRUE(check_standing(rig, facing).has_value());
  rig.keep_out[1].clearance_m += 2e-9;
  EXPECT_FALSE(check_standing(rig, facing).has_value());
}

// The property that matters: whatever the four axes' progress, in an allowed move no state on the way breaks
// a rule or a limit.
TEST(CheckMove, NoStateOfAnAllowedMoveBreaksARule) {
  const RigConfig rig = cramped_rig();
  base::Random random(test::seed(61));
  int allowed = 0;
  for (int i = 0; i < 12000; ++i) {
    const JointAngles from = random_angles(rig, random);
    JointAngles to = random_angles(rig, random);
    // Long and short moves.
    const double share = i % 2 == 0 ? 1 : 0.1;
    for (std::size_t k = 0; k < kAxisCount; ++k) to[k] = from[k] + share * (to[k] - from[k]);
    if (!check_standing(rig, from) || !check_move(rig, from, to)) continue;
    ++allowed;
    for (int s = 0; s < 50; ++s) {
      JointAngles on_the_way{};
      for (std::size_t k = 0; k < kAxisCount; ++k) {
        const AxisLegs legs = plan_legs(rig.axes[k], from[k], to[k]);
        // Axes wait for each other in no particular way: each is anywhere on its own legs, ends included.
        const double progress = s % 10 == 0 ? static_cast<double>(random.below(2)) : random.uniform();
        const bool first = random.below(2) == 0;
        const double begin = legs.has_detour && !first ? legs.detour_rad : from[k];
        const double end = legs.has_detour && first ? legs.detour_rad : to[k];
        on_the_way[k] = begin + progress * (end - begin);
      }
      for (const KeepOut& rule : rig.keep_out) {
        ASSERT_GE(sampled_clearance(rig, rule, on_the_way), rule.clearance_m) << rule.name;
      }
      for (std::size_t k = 0; k < kAxisCount; ++k) {
        ASSERT_GE(on_the_way[k], rig.axes[k].min_rad - 1e-12);
        ASSERT_LE(on_the_way[k], rig.axes[k].max_rad + 1e-12);
      }
    }
  }
  EXPECT_GT(allowed, 400);
}

// And the other way: a refused move between allowed poses really has a forbidden state, so that planning does
// not lose poses to caution.
TEST(CheckMove, ARefusedMoveHasAForbiddenState) {
  const RigConfig rig = cramped_rig();
  RigConfig stricter = rig;  // by the caution of the check and the coarseness of the search below
  for (KeepOut& rule : stricter.keep_out) rule.clearance_m += 0.002;
  base::Random random(test::seed(62));
  int refused = 0;
  for (int i = 0; i < 4000 && refused < 300; ++i) {
    const JointAngles from = random_angles(rig, random);
    const JointAngles to = random_angles(rig, random);
    if (!check_standing(rig, from) || !check_standing(rig, to) || check_move(rig, from, to)) continue;
    ++refused;
    bool found = false;
    constexpr int kSteps = 40;
    for (int a = 0; a <= kSteps && !found; ++a) {
      for (int b = 0; b <= kSteps && !found; ++b) {
        for (int c = 0; c <= kSteps && !found; ++c) {
          JointAngles on_the_way = to;
          const int share[kAxisCount] = {0, a, b, c};
          for (std::size_t k = 1; k < kAxisCount; ++k) {
            const AxisLegs legs = plan_legs(rig.axes[k], from[k], to[k]);
            const double low = std::min({from[k], to[k], legs.has_detour ? legs.detour_rad : to[k]});
            const double high = std::max(from[k], to[k]);
            on_the_way[k] = low + (high - low) * share[k] / kSteps;
          }
          found = !check_standing(stricter, on_the_way).has_value();
        }
      }
    }
    EXPECT_TRUE(found);
  }
  EXPECT_GT(refused, 50);
}

TEST(CheckMove, StandingStillIsAllowedWhereStandingIs) {
  const RigConfig rig = cramped_rig();
  base::Random random(test::seed(63));
  for (int i = 0; i < 2000; ++i) {
    const JointAngles angles = random_angles(rig, random);
    EXPECT_EQ(check_standing(rig, angles).has_value(), check_move(rig, angles, angles).has_value());
  }
}

TEST(CheckMove, RollAloneNeverMatters) {
  const RigConfig rig = cramped_rig();
  base::Random random(test::seed(64));
  int tried = 0;
  for (int i = 0; i < 2000; ++i) {
    const JointAngles from = random_angles(rig, random);
    if (!check_standing(rig, from)) continue;
    JointAngles to = from;
    to[0] = random.uniform(rig.axes[0].min_rad, rig.axes[0].max_rad);
    EXPECT_TRUE(check_move(rig, from, to).has_value()) << "the carrier is a disc";
    ++tried;
  }
  EXPECT_GT(tried, 200);
}

TEST(CheckMove, AnAxisFoundOutsideMayBeDrivenBackIn) {
  const RigConfig rig = rig_with({});
  const JointAngles outside{0, radians(76), 0, radians(45)};
  EXPECT_TRUE(check_move(rig, outside, {0, radians(70), 0, radians(45)}).has_value());
  EXPECT_FALSE(check_move(rig, outside, {0, radians(75.5), 0, radians(45)}).has_value());
  EXPECT_FALSE(check_move(rig, outside, {0, radians(80), 0, radians(45)}).has_value())
      << "further out it may not";
}

TEST(CheckMove, FromAnUnknownPositionNothingMoves) {
  const RigConfig rig = rig_with({});
  const auto refused = check_move(rig, {0, std::nan(""), 0, radians(45)}, {0, 0, 0, radians(45)});
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().what, HasSubstr("the position of axis tilt is not known"));
}

// The detour of a one-sided approach can reach into a zone that neither end touches.
TEST(CheckMove, TheDetourIsPartOfTheWay) {
  const auto changes = [](const char* approach) {
    return Changes{{"min_deg = 10.0", "min_deg = 0.0"},
                   {"clearance_mm = 30.0", "clearance_mm = 76.0"},
                   {"approach_deg = 1.0", approach}};
  };
  // Straight ahead the light is 75.4 mm from the camera; 76 mm are reached at about 1 deg.
  const JointAngles from{0, 0, 0, radians(20)};
  const JointAngles to{0, 0, 0, radians(4)};
  EXPECT_TRUE(check_move(rig_with(changes("approach_deg = 1.0")), from, to).has_value());
  EXPECT_FALSE(check_move(rig_with(changes("approach_deg = 4.0")), from, to).has_value());
}

}  // namespace
}  // namespace rig::machine
