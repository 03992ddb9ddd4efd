// When a motion counts as over: the status of the motion before must never pass for that of this one.
#include "drivers/modbus_axis/motion_watch.h"

#include <gtest/gtest.h>

namespace rig::drivers::modbus {
namespace {

using std::chrono::milliseconds;

constexpr MotionTimes kTimes{100, 500, 50, 2};

struct Status {
  bool running = false, complete = true, homed = true, fault = false;
};

// A drive with both bits, asked every 10 ms.
class Watched : public testing::Test {
 protected:
  static Reading reading(double position, const Status& status) {
    Reading r;
    r.position_counts = position;
    r.fault = status.fault;
    r.enabled = true;
    r.homed = status.homed;
    r.moving = status.running;
    r.complete = status.complete;
    return r;
  }
  bool moving(double position, const Status& status) {
    now_ += milliseconds(10);
    return watch_.moving(now_, reading(position, status));
  }
  // Asked so many times with the same answer: how often it said "moving" before it first did not.
  int moving_times(int most, double position, const Status& status) {
    int times = 0;
    while (times < most && moving(position, status)) ++times;
    return times;
  }
  void move(double from, double to, const Status& before = {}) {
    watch_.move(now_, reading(from, before), to);
  }

  base::Time now_{std::chrono::hours(1)};
  MotionWatch watch_{kTimes};
};

TEST_F(Watched, TheCompleteOfTheMoveBeforeIsNotBelieved) {
  move(0, 1000);
  // The drive still shows what it showed before.
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(moving(0, {})) << i;
  EXPECT_TRUE(moving(3, {true, false}));
  EXPECT_TRUE(moving(900, {true, false}));
  EXPECT_FALSE(moving(1000, {false, true}));
}

TEST_F(Watched, ARunningBitProvesThatItTookTheCommand) {
  move(0, 1000);
  EXPECT_TRUE(moving(0, {true, true}));
  EXPECT_FALSE(moving(1000, {false, true}));
}

TEST_F(Watched, AFallenCompleteProvesIt) {
  move(0, 1000);
  EXPECT_TRUE(moving(0, {false, false}));
  EXPECT_FALSE(moving(1000, {false, true}));
}

TEST_F(Watched, AReadbackThatLeftItsPlaceProvesIt) {
  // A move so short that no reading saw it run.
  move(0, 5);
  EXPECT_FALSE(moving(5, {}));
}

TEST_F(Watched, WithoutAnyProofTheStatusIsBelievedAfterTheTimeToTakeIt) {
  // To where it stands.
  move(500, 500);
  EXPECT_EQ(moving_times(50, 500, {}), 9);
}

TEST_F(Watched, AReplacedMoveProvesNothingByRunning) {
  // It still runs to the old target, ends there, and only then takes the new one.
  move(400, 1000, {true, false});
  EXPECT_TRUE(moving(450, {true, false}));
  EXPECT_TRUE(moving(500, {false, true}));
  EXPECT_TRUE(moving(500, {false, true}));
  EXPECT_TRUE(moving(510, {true, false}));
  EXPECT_TRUE(moving(900, {true, false}));
  // By now the time to take it has passed.
  now_ += milliseconds(100);
  EXPECT_TRUE(moving(990, {true, false}));
  EXPECT_FALSE(moving(1000, {false, true}));
}

TEST_F(Watched, CompleteAloneIsNotEnoughWhileTheReadbackStillMoves) {
  move(0, 1000);
  EXPECT_TRUE(moving(400, {true, false}));
  // The drive has put out its last step, the load still follows.
  EXPECT_TRUE(moving(980, {false, true}));
  EXPECT_TRUE(moving(990, {false, true}));
  EXPECT_FALSE(moving(999, {false, true}));
}

TEST_F(Watched, AMoveThatEndsElsewhereIsOverOnceItStandsStill) {
  move(0, 1000);
  EXPECT_TRUE(moving(400, {true, false}));
  EXPECT_TRUE(moving(600, {false, true}));
  EXPECT_EQ(moving_times(50, 600, {false, true}), 4);
}

TEST_F(Watched, ADriveThatStopsShortAndNeverSaysCompleteIsBelievedInTheEnd) {
  move(0, 1000);
  EXPECT_TRUE(moving(400, {true, false}));
  // At a limit switch.
  EXPECT_EQ(moving_times(100, 600, {false, false}), 50);
}

TEST_F(Watched, AnAlarmEndsAMotion) {
  move(0, 1000);
  EXPECT_TRUE(moving(400, {true, false}));
  EXPECT_TRUE(moving(450, {false, false, true, true}));
  EXPECT_EQ(moving_times(50, 450, {false, false, true, true}), 4);
}

TEST_F(Watched, HomingIsOverWhenTheDriveIsHomedAndStands) {
  watch_.home(now_, reading(700, {false, true, true}));
  EXPECT_TRUE(moving(700, {false, true, true}));  // homed from before
  EXPECT_TRUE(watch_.homing());
  EXPECT_TRUE(moving(650, {true, false, false}));
  EXPECT_TRUE(moving(-20, {false, false, false}));  // turns round at the switch
  EXPECT_TRUE(moving(-10, {true, false, false}));
  EXPECT_TRUE(moving(0, {false, false, true}));
  EXPECT_EQ(moving_times(50, 0, {false, false, true}), 4);
  EXPECT_FALSE(watch_.homing());
  EXPECT_TRUE(watch_.homed_here());
}

TEST_F(Watched, HomingThatFindsNothingEnds) {
  watch_.home(now_, reading(700, {false, true, false}));
  EXPECT_TRUE(moving(650, {true, false, false}));
  EXPECT_LE(moving_times(200, -5000, {false, false, false}), 51);
  EXPECT_FALSE(watch_.homing());
}

TEST_F(Watched, WhatIsRememberedOfHomingGoesWithAnAlarmAndWithTheDrive) {
  const auto home = [this] {
    watch_.home(now_, reading(0, {}));
    EXPECT_LT(moving_times(50, 0, {}), 50);
    EXPECT_TRUE(watch_.homed_here());
  };
  home();
  (void)moving(0, {false, true, true, true});
  EXPECT_FALSE(watch_.homed_here());
  home();
  watch_.forget();
  EXPECT_FALSE(watch_.homed_here());
  home();
  watch_.home(now_, reading(0, {}));
  EXPECT_FALSE(watch_.homed_here());
}

TEST_F(Watched, AStopIsOverWhenNothingRunsAndTheReadbackStands) {
  move(0, 1000);
  EXPECT_TRUE(moving(400, {true, false}));
  watch_.stop(now_);
  EXPECT_TRUE(moving(450, {true, false}));
  EXPECT_TRUE(moving(470, {false, false}));
  // Quick stops leave "complete" as it is on some drives.
  EXPECT_EQ(moving_times(50, 470, {false, false}), 4);
}

TEST_F(Watched, AMotionThatSomebodyElseBeganIsSeen) {
  EXPECT_TRUE(moving(0, {true, false}));
  EXPECT_FALSE(moving(100, {false, false}));
}

TEST(MotionWatch, KnowsDrivesWithACompleteBitAlone) {
  MotionWatch watch(kTimes);
  base::Time now{std::chrono::hours(1)};
  const auto moving = [&](double position, bool complete) {
    now += milliseconds(10);
    Reading r;
    r.position_counts = position;
    r.complete = complete;
    return watch.moving(now, r);
  };
  // After power-up nothing is complete, and nothing moves.
  EXPECT_TRUE(moving(0, false));
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(moving(0, false));
  EXPECT_FALSE(moving(0, false));
  Reading before;
  before.complete = true;
  watch.move(now, before, 100);
  EXPECT_TRUE(moving(0, true));
  EXPECT_TRUE(moving(50, false));
  EXPECT_FALSE(moving(100, true));
}

}  // namespace
}  // namespace rig::drivers::modbus
