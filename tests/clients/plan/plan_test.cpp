// The pose chooser: its distance against brute force, its choice against its promise.
#include "clients/plan/plan.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <set>
#include <sstream>

#include "clients/plan/pair_grid.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "core/base/units.h"
#include "core/geometry/directions.h"
#include "core/machine/kinematics.h"
#include "core/machine/limits.h"
#include "tests/core/seed.h"

namespace rig::plan {
namespace {

using base::degrees;
using base::kPi;
using base::radians;
using geometry::Vec3;
using machine::DirectionPair;
using testing::HasSubstr;

machine::RigConfig shipped_rig() {
  auto rig = machine::load_rig_config(RIG_SOURCE_DIR "/share/virtual/rig.toml");
  EXPECT_TRUE(rig.has_value()) << rig.error().text();
  return std::move(rig).value();
}

// The example of McAllister 2002, 3.3.2: a highlight of cos^128, seen down to 0.3, four samples in it. He
// prints 7.84 deg, 0.00934, 428, 6.94, 16.3 and 31.6 deg, rounded on the way.
TEST(Density, TheDissertationsExample) {
  const auto d = density_for(128, 0.3, 4);
  ASSERT_TRUE(d.has_value());
  EXPECT_NEAR(degrees(d->highlight_rad), 7.846, 5e-4);
  EXPECT_NEAR(d->hemisphere_share, 0.009362, 5e-7);
  EXPECT_NEAR(d->poses, 427.3, 0.05);
  EXPECT_NEAR(degrees(d->apart_2d_rad), 6.948, 5e-4);
  EXPECT_NEAR(degrees(d->apart_3d_rad), 16.318, 5e-4);
  EXPECT_NEAR(degrees(d->apart_4d_rad), 31.589, 5e-4);
}

TEST(Density, SharperHighlightsNeedCloserPoses) {
  double before = kPi;
  for (const double n : {1.0, 10.0, 100.0, 1e4, 1e6}) {
    const auto d = density_for(n, 0.3, 4);
    ASSERT_TRUE(d.has_value());
    EXPECT_NEAR(std::pow(std::cos(d->highlight_rad), n), 0.3, 1e-6) << "the definition of theta_r";
    EXPECT_NEAR(d->hemisphere_share, 1 - std::cos(d->highlight_rad), 1e-9);
    EXPECT_LT(d->apart_3d_rad, before);
    before = d->apart_3d_rad;
  }
}

TEST(Density, RefusesWhatHasNoAnswer) {
  for (const double bad : {0.0, -1.0, std::nan(""), 1e300})
    EXPECT_FALSE(density_for(bad, 0.3, 4).has_value());
  for (const double bad : {0.0, 1.0, 2.0, -0.1, std::nan("")})
    EXPECT_FALSE(density_for(10, bad, 4).has_value());
  for (const double bad : {0.0, -4.0, std::nan("")}) EXPECT_FALSE(density_for(10, 0.3, bad).has_value());
}

Vec3 random_direction(base::Random& random) {
  return geometry::direction_from_polar({std::acos(random.uniform(0.05, 1)), random.uniform(-kPi, kPi)});
}

DirectionPair random_pair(base::Random& random) {
  return {random_direction(random), random_direction(random)};
}

// A pair nearby: each direction moved by about the same angle.
DirectionPair moved(const DirectionPair& pair, double angle, base::Random& random) {
  const auto move = [&](Vec3 d) {
    Vec3 out = geometry::normalized(d + angle * Vec3{random.normal(), random.normal(), random.normal()});
    out.z = std::abs(out.z);
    return out;
  };
  return {move(pair.incident), move(pair.exitant)};
}

Vec3 turned(Vec3 d, double angle) {
  return geometry::rotation_z(angle) * d;
}

// The definition, taken literally: every rotation in steps of 0.1 deg, refined around the best.
double brute_force(const DirectionPair& a, const DirectionPair& b) {
  double least = 1e9;
  for (const bool exchange : {false, true}) {
    for (const double mirror : {1.0, -1.0}) {
      Vec3 i = exchange ? b.exitant : b.incident;
      Vec3 r = exchange ? b.incident : b.exitant;
      i.y *= mirror;
      r.y *= mirror;
      const auto squared = [&](double psi) {
        return std::pow(geometry::angle_between(a.incident, turned(i, psi)), 2) +
               std::pow(geometry::angle_between(a.exitant, turned(r, psi)), 2);
      };
      double best = 0;
      for (int k = 0; k < 3600; ++k) {
        if (squared(radians(0.1 * k)) < squared(best)) best = radians(0.1 * k);
      }
      double step = radians(0.05);
      while (step > 1e-9) {
        for (const double psi : {best - step, best + step}) {
          if (squared(psi) < squared(best)) best = psi;
        }
        step *= 0.5;
      }
      least = std::min(least, squared(best));
    }
  }
  return std::sqrt(least);
}

TEST(PairDistance, IsTheLeastOverEveryRotationMirrorImageAndExchange) {
  base::Random random(test::seed(90));
  for (int i = 0; i < 100; ++i) {
    const DirectionPair a = random_pair(random);
    // Half of them near, where the planner decides; some near the pole.
    const DirectionPair b = i % 2 == 0 ? random_pair(random) : moved(a, random.uniform(0, 0.3), random);
    const double expected = brute_force(a, b);
    EXPECT_NEAR(pair_distance(IsotropicPair(a), IsotropicPair(b)), expected, 1e-6);
  }
}

TEST(PairDistance, IsBlindToWhatTheMaterialCannotTell) {
  base::Random random(test::seed(91));
  for (int i = 0; i < 300; ++i) {
    const DirectionPair a = random_pair(random);
    const DirectionPair b = random_pair(random);
    const double psi = random.uniform(-kPi, kPi);
    const DirectionPair rotated{turned(b.incident, psi), turned(b.exitant, psi)};
    const DirectionPair mirrored{{b.incident.x, -b.incident.y, b.incident.z},
                                 {b.exitant.x, -b.exitant.y, b.exitant.z}};
    const DirectionPair exchanged{b.exitant, b.incident};
    const double d = pair_distance(IsotropicPair(a), IsotropicPair(b));
    for (const DirectionPair& same : {rotated, mirrored, exchanged}) {
      EXPECT_NEAR(pair_distance(IsotropicPair(a), IsotropicPair(same)), d, 1e-7);
      EXPECT_NEAR(pair_distance(IsotropicPair(b), IsotropicPair(same)), 0, 1e-6);
    }
    EXPECT_NEAR(pair_distance(IsotropicPair(b), IsotropicPair(a)), d, 1e-7) << "symmetric";
  }
}

TEST(PairDistance, AtThePoleAzimuthDoesNotCount) {
  const IsotropicPair a(radians(0.01), radians(40), 0.0);
  const IsotropicPair b(radians(0.01), radians(40), kPi);
  EXPECT_LT(degrees(pair_distance(a, b)), 0.03);
  // And where it counts: both at 40 deg, azimuths 10 deg apart shared by two turns of 5 deg.
  const IsotropicPair c(radians(40), radians(40), radians(90));
  const IsotropicPair d(radians(40), radians(40), radians(100));
  const double each = 2 * std::asin(std::sin(radians(40)) * std::sin(radians(2.5)));
  EXPECT_NEAR(pair_distance(c, d), std::sqrt(2) * each, 1e-9);
}

TEST(NearerThan, DecidesAsTheDistanceDoes) {
  base::Random random(test::seed(92));
  int near = 0;
  for (int i = 0; i < 20000; ++i) {
    const DirectionPair a = random_pair(random);
    const DirectionPair b = i % 2 == 0 ? random_pair(random) : moved(a, random.uniform(0, 0.3), random);
    const double distance = pair_distance(IsotropicPair(a), IsotropicPair(b));
    const double limit = distance * random.uniform(0.9, 1.1);
    if (std::abs(limit - distance) < 1e-8) continue;
    const bool answer = nearer_than(IsotropicPair(a), IsotropicPair(b), limit);
    EXPECT_EQ(answer, distance <= limit) << distance << " " << limit;
    near += answer ? 1 : 0;
  }
  EXPECT_GT(near, 5000);
}

TEST(PairGrid, FindsWhatALinearSearchFinds) {
  base::Random random(test::seed(93));
  for (const double limit_deg : {3.0, 8.0, 20.0, 60.0}) {
    PairGrid grid(radians(limit_deg));
    std::vector<IsotropicPair> all;
    for (int i = 0; i < 150; ++i) {
      all.emplace_back(random_pair(random));
      grid.add(all.back());
    }
    for (int i = 0; i < 2000; ++i) {
      const IsotropicPair pair(random_pair(random));
      const bool expected = std::any_of(all.begin(), all.end(), [&](const IsotropicPair& other) {
        return nearer_than(pair, other, radians(limit_deg));
      });
      EXPECT_EQ(grid.any_near(pair), expected);
    }
  }
}

const ChoiceOptions kOptions{radians(14), radians(2), radians(75), radians(65)};

class ChosenPoses : public testing::Test {
 protected:
  machine::RigConfig rig_ = shipped_rig();
  Choice choice_ = choose_poses(rig_, kOptions).value();
};

TEST_F(ChosenPoses, AreAllFartherApartThanAsked) {
  ASSERT_GT(choice_.pairs.size(), 50U);
  for (std::size_t i = 0; i < choice_.pairs.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GT(pair_distance(choice_.pairs[i], choice_.pairs[j]), kOptions.apart_rad);
    }
  }
}

TEST_F(ChosenPoses, LeaveNoReachablePairFarFromAll) {
  base::Random random(test::seed(94));
  int tried = 0;
  int within = 0;
  while (tried < 3000) {
    const auto axis = [&](std::size_t i) {
      return random.uniform(rig_.axes[i].min_rad, rig_.axes[i].max_rad);
    };
    const machine::JointAngles angles{0, axis(1), axis(2), axis(3)};
    const IsotropicPair pair(machine::directions_at_centre(rig_, angles));
    if (pair.incident_rad() > kOptions.max_incident_rad || pair.exitant_rad() > kOptions.max_exitant_rad)
      continue;
    // Off the stations of the walk: two directions change with up to three axes that are half a step off
    // each.
    const double limit = kOptions.apart_rad + 3 * kOptions.step_rad;
    const auto is_near = [&](double distance) {
      return std::any_of(choice_.pairs.begin(), choice_.pairs.end(),
                         [&](const IsotropicPair& kept) { return nearer_than(pair, kept, distance); });
    };
    EXPECT_TRUE(is_near(limit)) << degrees(pair.incident_rad()) << " " << degrees(pair.exitant_rad());
    within += is_near(kOptions.apart_rad) ? 1 : 0;
    ++tried;
  }
  EXPECT_GT(within, tried * 9 / 10);
}

TEST_F(ChosenPoses, StayWithinTheSteepestAnglesAndTheRig) {
  EXPECT_EQ(choice_.poses.size(), choice_.pairs.size());
  for (std::size_t i = 0; i < choice_.poses.size(); ++i) {
    const auto pair = machine::directions_at_centre(rig_, choice_.poses[i]);
    EXPECT_LE(degrees(geometry::angle_between(pair.incident, {0, 0, 1})), 75 + 1e-9);
    EXPECT_LE(degrees(geometry::angle_between(pair.exitant, {0, 0, 1})), 65 + 1e-9);
    EXPECT_NEAR(geometry::angle_between(pair.incident, {0, 0, 1}), choice_.pairs[i].incident_rad(), 1e-12);
    EXPECT_TRUE(machine::check_standing(rig_, choice_.poses[i]).has_value());
  }
}

TEST_F(ChosenPoses, AreTheSameEveryTime) {
  EXPECT_EQ(choose_poses(rig_, kOptions)->poses, choice_.poses);
}

TEST_F(ChosenPoses, KeepOutOfZones) {
  machine::RigConfig guarded = rig_;
  guarded.keep_out[0].clearance_m = 0.5;  // light and camera: small arm angles are forbidden
  const auto choice = choose_poses(guarded, kOptions);
  ASSERT_TRUE(choice.has_value());
  EXPECT_GT(choice->kept_out, 0U);
  for (const auto& pose : choice->poses) EXPECT_TRUE(machine::check_standing(guarded, pose).has_value());
  EXPECT_LT(choice->poses.size(), choice_.poses.size());
  EXPECT_GT(choice->poses.size(), 10U);
}

TEST(ChoosePoses, MorePosesTheNearerTheyMayBe) {
  const auto rig = shipped_rig();
  std::size_t before = 0;
  for (const double apart_deg : {40.0, 25.0, 16.0, 10.0}) {
    const auto choice = choose_poses(rig, {radians(apart_deg), radians(2), radians(75), radians(65)});
    ASSERT_TRUE(choice.has_value());
    EXPECT_GT(choice->poses.size(), 1.3 * static_cast<double>(before));
    before = choice->poses.size();
  }
}

TEST(ChoosePoses, RefusesOptionsWithoutSense) {
  const auto rig = shipped_rig();
  const auto error = [&](ChoiceOptions options) {
    const auto choice = choose_poses(rig, options);
    return choice ? std::string("none") : choice.error().text();
  };
  EXPECT_THAT(error({0, radians(1), 1, 1}), HasSubstr("between poses"));
  EXPECT_THAT(error({std::nan(""), radians(1), 1, 1}), HasSubstr("between poses"));
  EXPECT_THAT(error({radians(10), 0, 1, 1}), HasSubstr("in steps of"));
  EXPECT_THAT(error({radians(10), radians(11), 1, 1}), HasSubstr("in steps of"));
  EXPECT_THAT(error({radians(10), radians(2), 2, 1}), HasSubstr("polar angle"));
  EXPECT_THAT(error({radians(10), radians(2), radians(1), radians(1)}), HasSubstr("can reach no pose"));
}

TEST(Rolls, AreOneInEachPartOfTheRange) {
  const auto rig = shipped_rig();
  for (const std::size_t count : {1U, 7U, 73U, 1000U}) {
    auto rolls = stratified_rolls(rig.axes[0], count, 5);
    ASSERT_EQ(rolls.size(), count);
    std::sort(rolls.begin(), rolls.end());
    for (std::size_t i = 0; i < count; ++i) {
      const double part = 2 * kPi / static_cast<double>(count);
      const double rounding = radians(0.001);
      EXPECT_GE(rolls[i], -kPi + part * static_cast<double>(i) - rounding);
      EXPECT_LE(rolls[i], -kPi + part * static_cast<double>(i + 1) + rounding);
    }
  }
}

TEST(Rolls, AreInRandomOrderThatTheSeedDetermines) {
  const auto rig = shipped_rig();
  const auto rolls = stratified_rolls(rig.axes[0], 500, 5);
  EXPECT_EQ(rolls, stratified_rolls(rig.axes[0], 500, 5));
  EXPECT_NE(rolls, stratified_rolls(rig.axes[0], 500, 6));
  // Neighbours in the order of choice do not resemble each other: the correlation of 500 shuffled values has
  // a standard deviation of 1 / sqrt(500); five of them.
  double product = 0;
  for (std::size_t i = 1; i < rolls.size(); ++i) product += rolls[i] * rolls[i - 1];
  EXPECT_LT(std::abs(product / 499 / (kPi * kPi / 3)), 5 / std::sqrt(500.0));
}

TEST(Rolls, StayWithinANarrowAxis) {
  machine::AxisConfig axis;
  axis.min_rad = radians(-20);
  axis.max_rad = radians(10);
  for (const double roll : stratified_rolls(axis, 100, 1)) {
    EXPECT_GE(roll, axis.min_rad);
    EXPECT_LE(roll, axis.max_rad);
  }
  axis.min_rad = radians(-400);
  axis.max_rad = radians(400);
  for (const double roll : stratified_rolls(axis, 100, 1)) EXPECT_LE(std::abs(roll), kPi + 1e-9);
}

class PlanFile : public testing::Test {
 protected:
  PlanFile() {
    std::string pattern = (std::filesystem::temp_directory_path() / "rig-plan-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    request_.choice = {radians(20), radians(2), radians(75), radians(65)};
    request_.seed = 3;
    request_.name = "night";
    request_.sample = "cloth";
    request_.exposure.exposures_s = {0.16, 0.02, 0.0025};
  }
  ~PlanFile() override { std::filesystem::remove_all(folder_); }
  PlanFile(const PlanFile&) = delete;
  PlanFile& operator=(const PlanFile&) = delete;

  machine::RigConfig rig_ = shipped_rig();
  PlanRequest request_;
  std::filesystem::path folder_;
};

TEST_F(PlanFile, IsAJobThatTheRigCanDo) {
  const auto plan = make_plan(rig_, request_);
  ASSERT_TRUE(plan.has_value()) << plan.error().text();
  const std::string path = folder_ / "job.toml";
  ASSERT_TRUE(write_plan(path, false, request_, *plan).has_value());
  const auto job = machine::load_job_config(path);
  ASSERT_TRUE(job.has_value()) << job.error().text();
  EXPECT_EQ(job->name, "night");
  EXPECT_EQ(job->poses, plan->job.poses);
  EXPECT_EQ(job->exposure.exposures_s, request_.exposure.exposures_s);
  EXPECT_TRUE(machine::check_job(rig_, *job).has_value());
  EXPECT_EQ(plan->cut_off, 0U) << "the camera sees the whole sample in every pose";
  EXPECT_EQ(plan->unreachable, 0U);
  // Every pose has a roll of its own.
  std::set<double> rolls;
  for (const auto& pose : job->poses) rolls.insert(pose[0]);
  EXPECT_EQ(rolls.size(), job->poses.size());
}

TEST_F(PlanFile, SummaryAddsUp) {
  const auto plan = make_plan(rig_, request_);
  ASSERT_TRUE(plan.has_value());
  const double poses = static_cast<double>(plan->job.poses.size());
  EXPECT_NEAR(plan->course.exposing_s, 0.1825 * poses, 1e-9);
  EXPECT_GT(plan->course.travel_s, 0.3 * poses) << "settling alone";
  EXPECT_EQ(plan->course.visits, 0);
  EXPECT_EQ(plan->warm_up_s, 900);
  const std::string text = summary(request_, *plan);
  EXPECT_THAT(text, HasSubstr(fmt::format("{} poses, 20.00 deg apart", plan->job.poses.size())));
  // The numbers of each histogram line add up to the poses.
  for (const char* title : {"   light", "   view"}) {
    const auto begin = text.find(title);
    ASSERT_NE(begin, std::string::npos);
    std::istringstream line(text.substr(begin + 8, text.find('\n', begin) - begin - 8));
    int sum = 0;
    for (int n = 0; line >> n;) sum += n;
    EXPECT_EQ(sum, static_cast<int>(poses)) << title;
  }
}

TEST_F(PlanFile, TheReferenceVisitsAreInTheEstimate) {
  const auto without = make_plan(rig_, request_);
  auto& reference = rig_.unattended.reference.emplace();
  reference.pose_rad = {0, base::radians(10.0), 0, base::radians(75.0)};
  reference.exposure_s = 0.02;
  reference.dark_exposure_s = 0.5;
  reference.every_poses = 10;
  const auto plan = make_plan(rig_, request_);
  ASSERT_TRUE(without.has_value() && plan.has_value());
  ASSERT_EQ(plan->job.poses, without->job.poses);
  // The first twice, one after every tenth pose, and the last.
  const int visits = 2 + (static_cast<int>(plan->job.poses.size()) - 1) / 10 + 1;
  EXPECT_EQ(plan->course.visits, visits);
  EXPECT_NEAR(plan->course.exposing_s - without->course.exposing_s, 0.52 * visits, 1e-9);
  EXPECT_GT(plan->course.travel_s, without->course.travel_s);
  EXPECT_THAT(summary(request_, *plan), HasSubstr(fmt::format(", with {} reference visits;", visits)));
  EXPECT_THAT(summary(request_, *without), HasSubstr(", with no reference visits;"));
}

TEST_F(PlanFile, HalvingCountsTheWholeBracket) {
  request_.exposure = {machine::ExposureStrategy::halve, {}, 0.8, 3, 0};
  const auto plan = make_plan(rig_, request_);
  ASSERT_TRUE(plan.has_value()) << plan.error().text();
  EXPECT_NEAR(plan->course.exposing_s, (0.8 + 0.4 + 0.2) * static_cast<double>(plan->job.poses.size()), 1e-9);
}

TEST_F(PlanFile, IsNotReplacedUnasked) {
  const auto plan = make_plan(rig_, request_);
  ASSERT_TRUE(plan.has_value());
  const std::string path = folder_ / "job.toml";
  ASSERT_TRUE(base::write_file_durably(path, "precious").has_value());
  const auto refused = write_plan(path, false, request_, *plan);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().text(), HasSubstr("--force"));
  EXPECT_EQ(base::read_file(path), "precious");
  EXPECT_TRUE(write_plan(path, true, request_, *plan).has_value());
  EXPECT_TRUE(machine::load_job_config(path).has_value());
}

TEST_F(PlanFile, NeverReplacesAFolder) {
  const auto plan = make_plan(rig_, request_);
  ASSERT_TRUE(plan.has_value());
  std::filesystem::create_directories(folder_ / "scans");
  ASSERT_TRUE(base::write_file_durably(folder_ / "scans" / "a", "precious").has_value());
  EXPECT_FALSE(write_plan(folder_ / "scans", true, request_, *plan).has_value());
  EXPECT_EQ(base::read_file(folder_ / "scans" / "a"), "precious");
}

TEST_F(PlanFile, AnExposureTheCameraCannotDoIsRefused) {
  request_.exposure.exposures_s = {100};
  const auto plan = make_plan(rig_, request_);
  ASSERT_FALSE(plan.has_value());
  EXPECT_THAT(plan.error().text(), HasSubstr("the camera takes"));
}

}  // namespace
}  // namespace rig::plan
