// Both clocks, and the queue that waits in them. Nothing here waits for the wall: threads wait for each
// other.
#include "core/base/clock.h"

#include <gtest/gtest.h>
#include <map>
#include <thread>
#include <vector>

namespace rig::base {
namespace {

constexpr Time kStart{seconds(1'000'000)};
constexpr Duration kHour = std::chrono::hours(1);

TEST(DiscreteEventClock, JumpsToTheDeadlineWhenItsOnlyMemberWaits) {
  const auto clock = make_discrete_event_clock(kStart);
  const ClockMember member(*clock);
  WaitSlot slot;
  EXPECT_FALSE(clock->wait(slot, kStart + 1000 * kHour, WaitFor::rig));
  EXPECT_EQ(clock->now(), kStart + 1000 * kHour);
}

TEST(DiscreteEventClock, HoldsStillWhileAMemberWorks) {
  const auto clock = make_discrete_event_clock(kStart);
  ClockMember here(*clock);
  WaitSlot mine;
  Time woken{};
  std::thread other([&, member = ClockMember(*clock)] {
    WaitSlot slot;
    clock->wait(slot, kStart + kHour, WaitFor::rig);
    woken = clock->now();
    clock->notify(mine);
  });
  // Whether the other already waits or not: this thread works, so no time passes.
  EXPECT_EQ(clock->now(), kStart);
  EXPECT_TRUE(clock->wait(mine, kStart + 2 * kHour, WaitFor::rig));
  EXPECT_EQ(woken, kStart + kHour)
      << "it jumped to the earlier deadline and held still while that thread worked";
  EXPECT_EQ(clock->now(), kStart + kHour) << "and went no further when it notified";
  other.join();
}

TEST(DiscreteEventClock, WakesMembersInTheOrderOfTheirDeadlines) {
  const auto clock = make_discrete_event_clock(kStart);
  std::mutex mutex;
  std::vector<std::pair<int, Time>> log;
  std::vector<std::thread> threads;
  // All are members before the first starts, so that no time passes between.
  std::vector<ClockMember> members;
  members.reserve(6);
  threads.reserve(6);
  for (int i = 0; i < 6; ++i) members.emplace_back(*clock);
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&, i, member = std::move(members[static_cast<std::size_t>(i)])] {
      WaitSlot slot;
      for (int round = 1; round <= 3; ++round) {
        const Time deadline = kStart + kHour * (6 * round - i);
        EXPECT_FALSE(clock->wait(slot, deadline, WaitFor::rig));
        EXPECT_EQ(clock->now(), deadline);
        const std::lock_guard lock(mutex);
        log.emplace_back(i, clock->now());
      }
    });
  }
  for (auto& thread : threads) thread.join();
  ASSERT_EQ(log.size(), 18U);
  for (std::size_t k = 0; k < log.size(); ++k) {
    EXPECT_EQ(log[k].second, kStart + kHour * static_cast<int>(k + 1));
    EXPECT_EQ(log[k].first, 5 - static_cast<int>(k % 6));
  }
}

TEST(DiscreteEventClock, ANotificationBeforeTheWaitCounts) {
  const auto clock = make_discrete_event_clock(kStart);
  const ClockMember member(*clock);
  WaitSlot slot;
  clock->notify(slot);
  EXPECT_TRUE(clock->wait(slot, kStart + kHour, WaitFor::rig));
  EXPECT_EQ(clock->now(), kStart);
  EXPECT_FALSE(clock->wait(slot, kStart + kHour, WaitFor::rig)) << "and counts once";
}

TEST(DiscreteEventClock, DoesNotJumpForAPerson) {
  const auto clock = make_discrete_event_clock(kStart);
  WaitSlot persons;
  bool notified = false;
  std::thread person([&, member = ClockMember(*clock)] {
    notified = clock->wait(persons, kStart + 1000 * kHour, WaitFor::person);
  });
  {
    ClockMember here(*clock);
    WaitSlot slot;
    // Returns only once both wait: from here on the other is known to wait for its person.
    EXPECT_FALSE(clock->wait(slot, kStart + kHour, WaitFor::rig));
    EXPECT_EQ(clock->now(), kStart + kHour);
  }
  // Only the person's deadline is left; the clock runs with the wall until somebody comes.
  clock->notify(persons);
  person.join();
  EXPECT_TRUE(notified);
  EXPECT_LT(clock->now(), kStart + 2 * kHour);
}

TEST(DiscreteEventClock, AMemberThatLeavesNoLongerHoldsTime) {
  const auto clock = make_discrete_event_clock(kStart);
  auto here = std::make_unique<ClockMember>(*clock);
  Time woken{};
  std::thread other([&, member = ClockMember(*clock)] {
    WaitSlot slot;
    clock->wait(slot, kStart + kHour, WaitFor::rig);
    woken = clock->now();
  });
  EXPECT_EQ(clock->now(), kStart);
  here.reset();
  other.join();
  EXPECT_EQ(woken, kStart + kHour);
}

TEST(DiscreteEventClock, ADeadlineInThePastPassesAtOnce) {
  const auto clock = make_discrete_event_clock(kStart);
  const ClockMember member(*clock);
  WaitSlot slot;
  EXPECT_FALSE(clock->wait(slot, kStart - kHour, WaitFor::rig));
  EXPECT_EQ(clock->now(), kStart) << "time never goes back";
}

TEST(DiscreteEventClock, NotBeforeOnlyMovesForward) {
  const auto clock = make_discrete_event_clock(kStart);
  const ClockMember member(*clock);
  clock->not_before(kStart + kHour);
  EXPECT_EQ(clock->now(), kStart + kHour);
  clock->not_before(kStart);
  EXPECT_EQ(clock->now(), kStart + kHour);
}

TEST(SystemClock, WaitsForNotificationAndForDeadlines) {
  const auto clock = make_system_clock();
  const Time before = clock->now();
  WaitSlot slot;
  EXPECT_FALSE(clock->wait(slot, before - kHour, WaitFor::rig));
  clock->notify(slot);
  EXPECT_TRUE(clock->wait(slot, before + kHour, WaitFor::rig));
  std::thread other([&] { clock->notify(slot); });
  EXPECT_TRUE(clock->wait(slot, std::nullopt, WaitFor::person));
  other.join();
  EXPECT_GE(clock->now(), before);
  clock->not_before(before + 10 * kHour);
  EXPECT_LT(clock->now(), before + kHour) << "the real world cannot be moved";
}

struct Item {
  int producer;
  int number;
};

// Many producers, one consumer: nothing is lost, nothing twice, each producer's order kept; and no simulated
// time passes while any of them works.
TEST(Mailbox, HandsOverFromManyThreadsInOrder) {
  const auto clock = make_discrete_event_clock(kStart);
  Mailbox<Item> mailbox(*clock);
  constexpr int kProducers = 4;
  constexpr int kItems = 2000;
  ClockMember here(*clock);
  std::vector<std::thread> producers;
  producers.reserve(kProducers);
  for (int p = 0; p < kProducers; ++p) {
    producers.emplace_back([&, p, member = ClockMember(*clock)] {
      for (int n = 0; n < kItems; ++n) mailbox.push({p, n});
    });
  }
  std::map<int, int> next;
  for (int k = 0; k < kProducers * kItems; ++k) {
    const auto item = mailbox.pop(kStart + kHour);
    ASSERT_TRUE(item.has_value());
    EXPECT_EQ(item->number, next[item->producer]++);
    EXPECT_EQ(clock->now(), kStart);
  }
  for (auto& producer : producers) producer.join();
  EXPECT_FALSE(mailbox.try_pop().has_value());
  EXPECT_FALSE(mailbox.pop(kStart + kHour).has_value());
  EXPECT_EQ(clock->now(), kStart + kHour);
}

TEST(Mailbox, AStopGoesFirst) {
  const auto clock = make_system_clock();
  Mailbox<int> mailbox(*clock);
  mailbox.push(1);
  mailbox.push(2);
  mailbox.push_front(9);
  EXPECT_EQ(mailbox.pop(), 9);
  EXPECT_EQ(mailbox.pop(), 1);
  EXPECT_EQ(mailbox.pop(), 2);
  EXPECT_EQ(mailbox.try_pop(), std::nullopt);
}

TEST(Mailbox, WhatCameBeforeThePopIsFoundAfterANotificationWasUsedUp) {
  const auto clock = make_discrete_event_clock(kStart);
  const ClockMember member(*clock);
  Mailbox<int> mailbox(*clock);
  mailbox.push(1);
  EXPECT_EQ(mailbox.try_pop(), 1);
  // The slot still holds the notification; the pop must go on waiting through it.
  EXPECT_EQ(mailbox.pop(kStart + kHour), std::nullopt);
  EXPECT_EQ(clock->now(), kStart + kHour);
}

}  // namespace
}  // namespace rig::base
