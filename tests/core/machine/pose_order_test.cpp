// The tour through the poses.
#include "core/machine/pose_order.h"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numeric>

#include "core/base/random.h"
#include "core/base/units.h"
#include "core/machine/limits.h"
#include "core/machine/motion.h"
#include "tests/core/machine/rig_file.h"
#include "tests/core/seed.h"

namespace rig::machine {
namespace {

using base::radians;

std::vector<JointAngles> random_poses(const RigConfig& rig, std::size_t count, base::Random& random) {
  std::vector<JointAngles> poses;
  while (poses.size() < count) {
    JointAngles angles{};
    for (std::size_t i = 0; i < kAxisCount; ++i) {
      angles[i] = random.uniform(rig.axes[i].min_rad, rig.axes[i].max_rad);
    }
    if (check_standing(rig, angles)) poses.push_back(angles);
  }
  return poses;
}

double duration(const RigConfig& rig, const JointAngles& start, const std::vector<JointAngles>& poses,
                const std::vector<std::size_t>& order) {
  double total = 0;
  const JointAngles* here = &start;
  for (const std::size_t i : order) {
    total += pose_change_time_s(rig, *here, poses[i]);
    here = &poses[i];
  }
  return total;
}

const JointAngles kHome{0, 0, 0, radians(45)};

TEST(PoseOrder, VisitsEveryPoseOnceAndSaysHowLongItTakes) {
  const RigConfig rig = rig_with({});
  base::Random random(test::seed(80));
  for (const std::size_t count : {0U, 1U, 2U, 3U, 60U}) {
    const auto poses = random_poses(rig, count, random);
    const PoseTour tour = order_poses(rig, kHome, poses);
    std::vector<std::size_t> all(count);
    std::iota(all.begin(), all.end(), std::size_t{0});
    EXPECT_THAT(tour.order, testing::UnorderedElementsAreArray(all));
    EXPECT_TRUE(tour.unreachable.empty());
    EXPECT_NEAR(tour.travel_s, duration(rig, kHome, poses, tour.order), 1e-9);
  }
}

TEST(PoseOrder, IsMuchShorterThanTheOrderGiven) {
  const RigConfig rig = rig_with({});
  base::Random random(test::seed(81));
  const auto poses = random_poses(rig, 200, random);
  std::vector<std::size_t> given(poses.size());
  std::iota(given.begin(), given.end(), std::size_t{0});
  const PoseTour tour = order_poses(rig, kHome, poses);
  EXPECT_LT(tour.travel_s, 0.6 * duration(rig, kHome, poses, given));
}

TEST(PoseOrder, FindsTheBestOfFew) {
  // All on the arm, upwards: the best tour is to take them in turn.
  const RigConfig rig = rig_with({});
  std::vector<JointAngles> poses;
  for (const double deg : {120.0, 60.0, 150.0, 90.0, 50.0, 170.0}) poses.push_back({0, 0, 0, radians(deg)});
  EXPECT_THAT(order_poses(rig, kHome, poses).order, testing::ElementsAre(4, 1, 3, 0, 2, 5));
}

TEST(PoseOrder, IsTheBestOfAllOrdersOfAFew) {
  const RigConfig rig = rig_with({});
  base::Random random(test::seed(84));
  for (int round = 0; round < 20; ++round) {
    const auto poses = random_poses(rig, 6, random);
    std::vector<std::size_t> order(poses.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    double best_s = duration(rig, kHome, poses, order);
    while (std::next_permutation(order.begin(), order.end())) {
      best_s = std::min(best_s, duration(rig, kHome, poses, order));
    }
    EXPECT_NEAR(order_poses(rig, kHome, poses).travel_s, best_s, 1e-3) << "round " << round;
  }
}

TEST(PoseOrder, TellsHowFarItIs) {
  const RigConfig rig = rig_with({});
  base::Random random(test::seed(85));
  const auto poses = random_poses(rig, 50, random);
  std::vector<std::size_t> told;
  std::size_t total = 0;
  const auto tour = order_poses(rig, kHome, poses, [&](std::size_t done, std::size_t all) {
    told.push_back(done);
    total = all;
  });
  ASSERT_GT(told.size(), 1U);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.back(), total);
  EXPECT_EQ(tour.order, order_poses(rig, kHome, poses).order) << "whether somebody listens changes nothing";
}

// What the two hundred poses of a night cost by a greedy tour, the best that needs no search.
TEST(PoseOrder, IsClearlyShorterThanAGreedyOne) {
  const RigConfig rig = rig_with({});
  base::Random random(test::seed(86));
  const auto poses = random_poses(rig, 200, random);
  std::vector<std::size_t> greedy;
  std::vector<bool> taken(poses.size(), false);
  const JointAngles* here = &kHome;
  while (greedy.size() < poses.size()) {
    std::size_t nearest = poses.size();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (taken[i]) continue;
      if (nearest == poses.size() ||
          pose_change_time_s(rig, *here, poses[i]) < pose_change_time_s(rig, *here, poses[nearest])) {
        nearest = i;
      }
    }
    taken[nearest] = true;
    greedy.push_back(nearest);
    here = &poses[nearest];
  }
  EXPECT_LT(order_poses(rig, kHome, poses).travel_s, 0.96 * duration(rig, kHome, poses, greedy));
}

TEST(PoseOrder, IsTheSameEveryTime) {
  const RigConfig rig = rig_with({});
  base::Random random(test::seed(82));
  auto poses = random_poses(rig, 100, random);
  poses.push_back(poses.front());  // equally near: the lower index comes first
  const PoseTour a = order_poses(rig, kHome, poses);
  const PoseTour b = order_poses(rig, kHome, poses);
  EXPECT_EQ(a.order, b.order);
}

TEST(PoseOrder, TakesOnlyAllowedMoves) {
  const RigConfig rig = cramped_rig();
  base::Random random(test::seed(83));
  const auto poses = random_poses(rig, 150, random);
  const PoseTour tour = order_poses(rig, kHome, poses);
  EXPECT_EQ(tour.order.size() + tour.unreachable.size(), poses.size());
  EXPECT_GT(tour.order.size(), 20U);
  const JointAngles* here = &kHome;
  for (const std::size_t i : tour.order) {
    EXPECT_TRUE(check_move(rig, *here, poses[i]).has_value());
    here = &poses[i];
  }
}

TEST(PoseOrder, NamesWhatNoMoveLeadsTo) {
  // The light may not pass the camera: what is on the other side stays there.
  const RigConfig rig =
      rig_with({{"min_deg = 10.0", "min_deg = -60.0"}, {"clearance_mm = 30.0", "clearance_mm = 100.0"}});
  const std::vector<JointAngles> poses{
      {0, 0, 0, radians(50)}, {0, 0, 0, radians(-50)}, {0, 0, 0, radians(60)}};
  const PoseTour tour = order_poses(rig, kHome, poses);
  EXPECT_THAT(tour.order, testing::ElementsAre(0, 2));
  EXPECT_THAT(tour.unreachable, testing::ElementsAre(1));
}

}  // namespace
}  // namespace rig::machine
