#include "sim/wire/motor.h"

#include <cmath>
#include <gtest/gtest.h>

namespace rig::sim::wire {
namespace {

using Time = Motor::Time;

Time at(double seconds) {
  return Time{} + std::chrono::hours(1) +
         std::chrono::duration_cast<Time::duration>(std::chrono::duration<double>(seconds));
}

constexpr Motor::Limits kWide{-1e6, 1e6};

TEST(Motor, StandsWhereItIsPut) {
  Motor motor(100, kWide);
  EXPECT_EQ(motor.position(at(0)), 100);
  EXPECT_FALSE(motor.moving(at(10)));
  EXPECT_EQ(motor.target(), 100);
  motor.put(at(11), -5);
  EXPECT_EQ(motor.position(at(12)), -5);
}

TEST(Motor, MovesInATrapezoid) {
  Motor motor(0, kWide);
  // 1000 counts at 500/s and 1000/s^2: half a second up, 1.5 s along, half a second down.
  motor.move_to(at(0), 1000, 500, 1000);
  EXPECT_NEAR(motor.position(at(0.5)), 125, 1);
  EXPECT_NEAR(motor.velocity(at(0.5)), 500, 1);
  EXPECT_NEAR(motor.position(at(1.25)), 500, 1);
  EXPECT_NEAR(motor.position(at(2.0)), 875, 1);
  EXPECT_TRUE(motor.moving(at(2.4)));
  EXPECT_FALSE(motor.moving(at(2.55)));
  EXPECT_EQ(motor.position(at(2.55)), 1000);
}

TEST(Motor, AShortMoveIsATriangle) {
  Motor motor(0, kWide);
  // 100 counts at 1000/s^2: 0.316 s up and as long down, never as fast as allowed.
  motor.move_to(at(0), -100, 500, 1000);
  EXPECT_NEAR(motor.position(at(0.3162)), -50, 1);
  EXPECT_NEAR(motor.velocity(at(0.3162)), -316, 2);
  EXPECT_TRUE(motor.moving(at(0.6)));
  EXPECT_FALSE(motor.moving(at(0.66)));
  EXPECT_EQ(motor.position(at(0.66)), -100);
}

TEST(Motor, NeverFasterThanAllowedAndNeverBeyondItsTarget) {
  Motor motor(0, kWide);
  motor.move_to(at(0), 777, 300, 900);
  double fastest = 0;
  double farthest = 0;
  for (int ms = 0; ms < 4000; ++ms) {
    fastest = std::max(fastest, motor.velocity(at(ms * 1e-3)));
    farthest = std::max(farthest, motor.position(at(ms * 1e-3)));
  }
  EXPECT_LE(fastest, 300.0001);
  EXPECT_LE(farthest, 777.1);
  EXPECT_EQ(motor.position(at(4)), 777);
}

TEST(Motor, NeverGoesBeyondItsTargetWhateverItsSpeeds) {
  for (const double acceleration : {100.0, 900.0, 4667.0, 4e5}) {
    for (const double speed : {100.0, 1166.0, 20000.0}) {
      for (const double target : {1.0, -7.0, 486.0, -6180.0}) {
        Motor motor(0, kWide);
        motor.move_to(at(0), target, speed, acceleration);
        double beyond = 0;
        double t = 0;
        while (motor.moving(at(t)) && t < 5000) {
          beyond = std::max(beyond, (motor.position(at(t)) - target) * (target > 0 ? 1 : -1));
          t += 0.3e-3;
        }
        EXPECT_LT(beyond, 1e-6) << target << " at " << speed << ", " << acceleration;
        EXPECT_EQ(motor.position(at(t)), target);
      }
    }
  }
}

TEST(Motor, HowOftenItIsLookedAtMakesNoDifference) {
  Motor often(0, kWide);
  Motor seldom(0, kWide);
  often.move_to(at(0), 1000, 500, 1000);
  seldom.move_to(at(0), 1000, 500, 1000);
  for (int ms = 0; ms <= 1700; ms += 10) (void)often.position(at(ms * 1e-3));
  EXPECT_NEAR(often.position(at(1.7)), seldom.position(at(1.7)), 1);
}

TEST(Motor, TurnsRoundByBraking) {
  Motor motor(0, kWide);
  motor.move_to(at(0), 1000, 500, 1000);
  ASSERT_NEAR(motor.velocity(at(1)), 500, 1);
  motor.move_to(at(1), 0, 500, 1000);
  EXPECT_GT(motor.velocity(at(1.2)), 0);
  EXPECT_LT(motor.velocity(at(1.8)), 0);
  EXPECT_FALSE(motor.moving(at(4)));
  EXPECT_EQ(motor.position(at(4)), 0);
}

TEST(Motor, BrakesWithItsDeceleration) {
  Motor motor(0, kWide);
  motor.move_to(at(0), 10000, 500, 1000);
  const double before = motor.position(at(2));
  motor.stop(at(2), 2500);
  EXPECT_TRUE(motor.moving(at(2.1)));
  EXPECT_FALSE(motor.moving(at(2.21)));
  // v^2 / 2a
  EXPECT_NEAR(motor.position(at(3)) - before, 50, 1);
  EXPECT_EQ(motor.target(), motor.position(at(3)));
}

TEST(Motor, AStopAtRestIsNothing) {
  Motor motor(7, kWide);
  motor.stop(at(1), 100);
  EXPECT_FALSE(motor.moving(at(2)));
  EXPECT_EQ(motor.position(at(2)), 7);
}

TEST(Motor, RunsUntilToldOtherwise) {
  Motor motor(0, kWide);
  motor.run(at(0), -100, 1000);
  EXPECT_NEAR(motor.position(at(10.05)), -1000, 1);
  EXPECT_TRUE(motor.moving(at(10.05)));
}

TEST(Motor, HasHardStops) {
  Motor motor(0, {-50, 200});
  motor.run(at(0), 100, 1000);
  EXPECT_EQ(motor.position(at(5)), 200);
  EXPECT_FALSE(motor.moving(at(5)));
  motor.move_to(at(5), -1000, 100, 1000);
  EXPECT_EQ(motor.position(at(15)), -50);
  EXPECT_FALSE(motor.moving(at(15)));
}

TEST(Motor, ATimeThatGoesBackIsNoTime) {
  Motor motor(0, kWide);
  motor.move_to(at(5), 100, 100, 1000);
  const double here = motor.position(at(5.5));
  EXPECT_EQ(motor.position(at(4)), here);
}

}  // namespace
}  // namespace rig::sim::wire
