// No moment in which an input was active is missed; with a debounce, no shorter one counts.
#include "drivers/gpiod_lines/input_filter.h"

#include <gtest/gtest.h>
#include <random>

#include "tests/core/seed.h"

namespace rig::drivers::gpiod_lines {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(InputFilter, RestIsInactive) {
  InputFilter filter(0);
  EXPECT_FALSE(filter.look({}, false, 1 * kMs));
  EXPECT_FALSE(filter.look({}, false, 2 * kMs));
}

TEST(InputFilter, AnActiveLevelCountsAsLongAsItLasts) {
  InputFilter filter(0);
  EXPECT_TRUE(filter.look({}, true, 1 * kMs));
  EXPECT_TRUE(filter.look({}, true, 2 * kMs));
}

TEST(InputFilter, APressBetweenTwoLooksCountsOnce) {
  InputFilter filter(0);
  EXPECT_FALSE(filter.look({}, false, 1 * kMs));
  const std::vector<Edge> press{{true, 2 * kMs}, {false, 3 * kMs}};
  EXPECT_TRUE(filter.look(press, false, 4 * kMs));
  EXPECT_FALSE(filter.look({}, false, 5 * kMs));
}

TEST(InputFilter, WhatWasActiveAfterTheLastLookCountsAgain) {
  InputFilter filter(0);
  EXPECT_TRUE(filter.look({}, true, 1 * kMs));
  const std::vector<Edge> let_go{{false, 2 * kMs}};
  EXPECT_TRUE(filter.look(let_go, false, 3 * kMs));
  EXPECT_FALSE(filter.look({}, false, 4 * kMs));
}

TEST(InputFilter, APulseThatWasOverWhenTheKernelLookedCounts) {
  InputFilter filter(0);
  EXPECT_FALSE(filter.look({}, false, 1 * kMs));
  const std::vector<Edge> two_edges_both_seen_inactive{{false, 2 * kMs}};
  EXPECT_TRUE(filter.look(two_edges_both_seen_inactive, false, 3 * kMs));
  EXPECT_FALSE(filter.look({}, false, 4 * kMs));
}

TEST(InputFilter, AChangeThatTheLevelToldBeforeItsEdgeCountsOnce) {
  InputFilter filter(0);
  EXPECT_TRUE(filter.look({}, true, 1 * kMs));
  EXPECT_TRUE(filter.look({}, false, 2 * kMs));  // it was active after the first look
  const std::vector<Edge> late{{false, 2 * kMs - 1}};
  EXPECT_FALSE(filter.look(late, false, 3 * kMs));
  const std::vector<Edge> pulse{{false, 4 * kMs}};
  EXPECT_TRUE(filter.look(pulse, false, 5 * kMs));
}

TEST(InputFilter, WithADebounceOnlyWhatLastsCounts) {
  InputFilter filter(5 * kMs);
  EXPECT_FALSE(filter.look({}, false, 0));
  const std::vector<Edge> glitch{{true, 10 * kMs}, {false, 12 * kMs}};
  EXPECT_FALSE(filter.look(glitch, false, 20 * kMs));
  const std::vector<Edge> glitches{{true, 21 * kMs}, {false, 25 * kMs}, {true, 26 * kMs}, {false, 30 * kMs}};
  EXPECT_FALSE(filter.look(glitches, false, 40 * kMs));
  const std::vector<Edge> unseen_rise{{false, 41 * kMs}};
  EXPECT_FALSE(filter.look(unseen_rise, false, 50 * kMs));
  const std::vector<Edge> press{{true, 60 * kMs}, {false, 65 * kMs}};
  EXPECT_TRUE(filter.look(press, false, 70 * kMs));
}

TEST(InputFilter, WithADebounceAPressIsJudgedAcrossLooks) {
  InputFilter filter(5 * kMs);
  EXPECT_FALSE(filter.look({}, false, 0));
  const std::vector<Edge> pressed{{true, 10 * kMs}};
  EXPECT_FALSE(filter.look(pressed, true, 12 * kMs));
  EXPECT_TRUE(filter.look({}, true, 15 * kMs));
  const std::vector<Edge> bounces{{false, 16 * kMs}, {true, 17 * kMs}, {false, 18 * kMs}};
  EXPECT_TRUE(filter.look(bounces, false, 20 * kMs));  // active until 16 ms, for longer than the debounce
  EXPECT_FALSE(filter.look({}, false, 30 * kMs));
}

TEST(InputFilter, AnInactiveBlinkDoesNotBeginAPressAnew) {
  InputFilter filter(5 * kMs);
  EXPECT_FALSE(filter.look({}, false, 0));
  const std::vector<Edge> edges{{true, 10 * kMs}, {true, 13 * kMs}};
  EXPECT_TRUE(filter.look(edges, true, 16 * kMs));
}

TEST(InputFilter, TheFirstLookNeedsNoDebounce) {
  InputFilter filter(500 * kMs);
  EXPECT_TRUE(filter.look({}, true, 1));
}

TEST(InputFilter, ALevelWithoutAnEdgeIsDebouncedFromWhenItWasSeen) {
  InputFilter filter(5 * kMs);
  EXPECT_FALSE(filter.look({}, false, 0));
  EXPECT_FALSE(filter.look({}, true, 10 * kMs));
  EXPECT_TRUE(filter.look({}, true, 15 * kMs));
  EXPECT_TRUE(filter.look({}, false, 16 * kMs));
  EXPECT_FALSE(filter.look({}, true, 20 * kMs));
  EXPECT_FALSE(filter.look({}, false, 22 * kMs));
}

TEST(InputFilter, AFullQueueCountsWhateverItSays) {
  InputFilter filter(100 * kMs);
  EXPECT_FALSE(filter.look({}, false, 0));
  std::vector<Edge> bounces;
  for (std::size_t i = 0; i < kEdgeQueue; ++i)
    bounces.push_back({i % 2 == 0, static_cast<std::int64_t>(i) * 1000});
  EXPECT_TRUE(filter.look(bounces, false, 1 * kMs));
  bounces.pop_back();
  InputFilter other(100 * kMs);
  EXPECT_FALSE(other.look({}, false, 0));
  EXPECT_FALSE(other.look(bounces, false, 1 * kMs));
}

TEST(InputFilter, TimesThatRunBackwardsCount) {
  InputFilter filter(5 * kMs);
  EXPECT_FALSE(filter.look({}, false, 0));
  const std::vector<Edge> of_another_clock{{true, 1'000'000 * kMs}};
  EXPECT_TRUE(filter.look(of_another_clock, true, 10 * kMs));
}

// A line that does what it likes, a kernel that keeps 16 changes of it and drops what comes later, and
// somebody who looks now and then.
TEST(InputFilter, WithoutADebounceNoActiveMomentIsMissedWhateverTheQueueLoses) {
  std::mt19937_64 random(test::seed(41));
  for (int run = 0; run < 200; ++run) {
    InputFilter filter(0);
    bool level = random() % 2 == 0;
    std::int64_t now = 0;
    bool was_active = level;
    std::vector<Edge> queue;
    for (int step = 0; step < 400; ++step) {
      now += static_cast<std::int64_t>(random() % 1000) + 1;
      if (random() % 8 != 0) {
        level = !level;
        was_active = was_active || level;
        if (queue.size() < kEdgeQueue) queue.push_back({level, now});
        continue;
      }
      const bool seen = filter.look(queue, level, now);
      const bool overflowed = queue.size() == kEdgeQueue;
      queue.clear();
      if (!overflowed || was_active) {
        ASSERT_EQ(seen, was_active) << "run " << run << ", step " << step;
      }
      was_active = level;
    }
  }
}

}  // namespace
}  // namespace rig::drivers::gpiod_lines
