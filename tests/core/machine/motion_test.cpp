// Move timing against a motor integrated step by step.
#include "core/machine/motion.h"

#include <cmath>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/base/units.h"
#include "tests/core/machine/rig_file.h"
#include "tests/core/seed.h"

namespace rig::machine {
namespace {

using base::radians;

// A motor that speeds up while it can still brake in time: the definition of a trapezoid, integrated in steps
// of dt. Calls at(t, position) after each step; returns when it has stopped.
template <typename Observe>
double integrate(double distance, double velocity, double acceleration, double dt, const Observe& observe) {
  double t = 0;
  double x = 0;
  double v = 0;
  while (x < distance) {
    const double braking = std::sqrt(2 * acceleration * (distance - x));
    v = std::min({velocity, v + acceleration * dt, braking});
    if (v * dt < 1e-12 * distance) break;
    x = std::min(distance, x + v * dt);
    t += dt;
    observe(t, x);
  }
  return t;
}

TEST(Travel, TakesAsLongAsAMotorIntegratedInSteps) {
  base::Random random(test::seed(70));
  for (int i = 0; i < 60; ++i) {
    const double velocity = random.uniform(0.01, 2);
    const double acceleration = random.uniform(0.05, 5);
    const double distance = std::pow(10, random.uniform(-3, 0.6));
    const double expected = travel_time_s(distance, velocity, acceleration);
    const double dt = expected / 20'000;
    double worst = 0;
    const double integrated = integrate(distance, velocity, acceleration, dt, [&](double t, double x) {
      worst = std::max(worst, std::abs(travel_share(distance, velocity, acceleration, t) - x / distance));
    });
    EXPECT_NEAR(integrated / expected, 1, 5e-3) << "braking in steps ends slowly";
    EXPECT_LT(worst, 1e-3);
  }
}

TEST(Travel, ClosedForms) {
  // 90 deg at 20 deg/s and 20 deg/s^2: a second up, a second down, 70 deg at full speed.
  EXPECT_DOUBLE_EQ(travel_time_s(radians(90), radians(20), radians(20)), 5.5);
  // 5 deg never reach full speed: 2 sqrt(5 / 20).
  EXPECT_DOUBLE_EQ(travel_time_s(radians(5), radians(20), radians(20)), 1.0);
  EXPECT_DOUBLE_EQ(travel_time_s(radians(-5), radians(20), radians(20)), 1.0) << "either direction";
  EXPECT_EQ(travel_time_s(0, 1, 1), 0);
}

TEST(Travel, ShareRunsFromZeroToOneAndNeverBack) {
  base::Random random(test::seed(71));
  for (int i = 0; i < 200; ++i) {
    const double distance = (i % 2 == 0 ? 1 : -1) * random.uniform(1e-6, 4);
    const double velocity = random.uniform(0.01, 2);
    const double acceleration = random.uniform(0.05, 5);
    const double total = travel_time_s(distance, velocity, acceleration);
    EXPECT_EQ(travel_share(distance, velocity, acceleration, -1), 0);
    EXPECT_EQ(travel_share(distance, velocity, acceleration, total), 1);
    EXPECT_EQ(travel_share(distance, velocity, acceleration, 2 * total), 1);
    EXPECT_NEAR(travel_share(distance, velocity, acceleration, total / 2), 0.5, 1e-9) << "symmetric";
    double before = 0;
    for (int k = 1; k < 100; ++k) {
      const double share = travel_share(distance, velocity, acceleration, total * k / 100);
      EXPECT_GE(share, before);
      before = share;
    }
  }
  EXPECT_EQ(travel_share(0, 1, 1, 0), 1) << "no distance is done at once";
}

TEST(Legs, TheLastLegComesFromBelow) {
  const RigConfig rig = rig_with({});
  const AxisConfig& tilt = rig.axes[1];
  base::Random random(test::seed(72));
  for (int i = 0; i < 5000; ++i) {
    const double from = random.uniform(tilt.min_rad, tilt.max_rad);
    const double to = random.uniform(tilt.min_rad, tilt.max_rad);
    const AxisLegs legs = plan_legs(tilt, from, to);
    EXPECT_EQ(legs.target_rad, to);
    if (legs.has_detour) {
      EXPECT_LT(legs.detour_rad, to);
      EXPECT_LT(legs.detour_rad, from);
      EXPECT_GE(legs.detour_rad, tilt.min_rad) << "within the limits";
      EXPECT_LE(to - legs.detour_rad, tilt.approach_rad + 1e-12);
    } else {
      EXPECT_TRUE(from <= to - tilt.approach_rad || std::abs(from - to) <= tilt.tolerance_rad ||
                  from <= tilt.min_rad || to <= tilt.min_rad);
    }
  }
}

TEST(Legs, NearTheLowerLimitTheDetourIsAsLongAsThereIsRoom) {
  const RigConfig rig = rig_with({});
  const AxisConfig& tilt = rig.axes[1];
  const AxisLegs legs = plan_legs(tilt, radians(0), radians(-74.5));
  ASSERT_TRUE(legs.has_detour);
  EXPECT_EQ(legs.detour_rad, tilt.min_rad);
  EXPECT_FALSE(plan_legs(tilt, radians(0), tilt.min_rad).has_detour) << "at the limit there is none";
  AxisConfig straight = tilt;
  straight.approach_rad = 0;
  EXPECT_FALSE(plan_legs(straight, radians(10), radians(0)).has_detour);
}

TEST(PoseChange, IsTheSlowestAxisWithItsDetourAndSettling) {
  const RigConfig rig = rig_with({});
  const JointAngles home{0, 0, 0, radians(45)};
  const auto time = [&](JointAngles to) { return pose_change_time_s(rig, home, to); };
  EXPECT_DOUBLE_EQ(time(home), 0.3) << "settling alone";
  // Arm upwards by 90 deg: 5.5 s; the quick tilt beside it costs nothing.
  EXPECT_DOUBLE_EQ(time({0, 0, 0, radians(135)}), 5.8);
  EXPECT_DOUBLE_EQ(time({0, radians(20), 0, radians(135)}), 5.8);
  // Downwards by 25 deg: 26 deg to the detour, then 1 deg up.
  const AxisConfig& arm = rig.axes[3];
  const auto travel = [&](double deg) {
    return travel_time_s(radians(deg), arm.max_velocity_rad_s, arm.max_acceleration_rad_s2);
  };
  EXPECT_NEAR(time({0, 0, 0, radians(20)}), travel(26) + travel(1) + 0.3, 1e-12);
}

}  // namespace
}  // namespace rig::machine
