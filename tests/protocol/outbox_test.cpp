// What waits for a client that does not read: answers before all, a bounded number of events, no previews;
// and nobody else's messages.
#include "protocol/outbox.h"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "core/base/log.h"
#include "tests/core/seed.h"

namespace rig::protocol {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const ClientId kAnna{0, "anna"};
const ClientId kBen{1, "ben"};

class OutboxTest : public testing::Test {
 protected:
  [[nodiscard]] Outbox outbox(std::size_t events, std::size_t answers, std::size_t answer_bytes) {
    return Outbox({events, answers, answer_bytes}, [this](const ClientId& client, std::string_view bytes) {
      if (std::count(gone_.begin(), gone_.end(), client) != 0) return Sent::gone;
      auto& room = room_[client];
      if (room == 0) return Sent::full;
      --room;
      got_[client].emplace_back(bytes);
      return Sent::yes;
    });
  }
  void flush(Outbox& box) {
    box.flush([this](const ClientId& client) { told_gone_.push_back(client); });
  }

  std::map<ClientId, std::size_t> room_;  // how many more messages a client's way takes
  std::map<ClientId, std::vector<std::string>> got_;
  std::vector<ClientId> gone_;
  std::vector<ClientId> told_gone_;
};

TEST_F(OutboxTest, SendsAtOnceWhereTheWayIsFree) {
  Outbox box = outbox(1, 1, 1);
  room_[kAnna] = 100;
  EXPECT_EQ(box.answer(kAnna, "a long answer"), Sent::yes);
  EXPECT_EQ(box.event(kAnna, "e1"), Sent::yes);
  EXPECT_EQ(box.event(kAnna, "e2"), Sent::yes);
  EXPECT_EQ(box.preview(kAnna, "p"), Sent::yes);
  EXPECT_THAT(got_[kAnna], ElementsAre("a long answer", "e1", "e2", "p"));
  EXPECT_FALSE(box.waiting());
  EXPECT_EQ(box.dropped(), 0U);
}

TEST_F(OutboxTest, KeepsWhatDoesNotGoAndSendsItInOrder) {
  Outbox box = outbox(10, 10, 1000);
  EXPECT_EQ(box.event(kAnna, "e1"), Sent::yes);
  EXPECT_EQ(box.answer(kAnna, "a1"), Sent::yes);
  EXPECT_EQ(box.event(kAnna, "e2"), Sent::yes);
  EXPECT_TRUE(box.waiting());
  // The way is free again, but what waits goes first.
  room_[kAnna] = 2;
  EXPECT_EQ(box.answer(kAnna, "a2"), Sent::yes);
  EXPECT_THAT(got_[kAnna], IsEmpty());
  flush(box);
  EXPECT_THAT(got_[kAnna], ElementsAre("e1", "a1"));
  EXPECT_TRUE(box.waiting());
  room_[kAnna] = 100;
  flush(box);
  EXPECT_THAT(got_[kAnna], ElementsAre("e1", "a1", "e2", "a2"));
  EXPECT_FALSE(box.waiting());
  EXPECT_EQ(box.dropped(), 0U);
}

TEST_F(OutboxTest, KeepsSoManyEventsAndCountsTheRest) {
  Outbox box = outbox(2, 10, 1000);
  EXPECT_EQ(box.event(kAnna, "e1"), Sent::yes);
  EXPECT_EQ(box.event(kAnna, "e2"), Sent::yes);
  EXPECT_EQ(box.event(kAnna, "e3"), Sent::full);
  EXPECT_EQ(box.event(kAnna, "e4"), Sent::full);
  EXPECT_EQ(box.dropped(), 2U);
  EXPECT_EQ(box.answer(kAnna, "a1"), Sent::yes) << "an answer is not an event";
  room_[kAnna] = 100;
  flush(box);
  EXPECT_THAT(got_[kAnna], ElementsAre("e1", "e2", "a1"));
}

TEST_F(OutboxTest, LosesEventsInOneGapOnly) {
  Outbox box = outbox(2, 10, 1000);
  for (const char* event : {"e1", "e2", "e3"}) (void)box.event(kAnna, event);
  room_[kAnna] = 1;
  flush(box);
  // There is room for one again; it would stand behind a gap with more gaps to come.
  EXPECT_EQ(box.event(kAnna, "e4"), Sent::full);
  room_[kAnna] = 100;
  flush(box);
  EXPECT_EQ(box.event(kAnna, "e5"), Sent::yes);
  EXPECT_THAT(got_[kAnna], ElementsAre("e1", "e2", "e5"));
  EXPECT_EQ(box.dropped(), 2U);
}

TEST_F(OutboxTest, BoundsAnswersInNumberAndBytes) {
  Outbox few = outbox(10, 2, 1000);
  EXPECT_EQ(few.answer(kAnna, "a1"), Sent::yes);
  EXPECT_EQ(few.answer(kAnna, "a2"), Sent::yes);
  EXPECT_EQ(few.answer(kAnna, "a3"), Sent::full);
  EXPECT_EQ(few.dropped(), 1U);

  Outbox small = outbox(10, 100, 10);
  EXPECT_EQ(small.answer(kBen, "123456"), Sent::yes);
  EXPECT_EQ(small.answer(kBen, "12345"), Sent::full);
  EXPECT_EQ(small.answer(kBen, "1234"), Sent::yes) << "just fits";
  room_[kBen] = 1;
  flush(small);
  EXPECT_EQ(small.answer(kBen, "123456"), Sent::yes) << "fits again";
  EXPECT_EQ(small.dropped(), 1U);
}

TEST_F(OutboxTest, KeepsOneAnswerHoweverLarge) {
  Outbox box = outbox(10, 100, 10);
  const std::string large(1000, 'x');
  EXPECT_EQ(box.event(kAnna, "e1"), Sent::yes);
  EXPECT_EQ(box.answer(kAnna, large), Sent::yes);
  EXPECT_EQ(box.answer(kAnna, "a"), Sent::full);
  room_[kAnna] = 100;
  flush(box);
  EXPECT_THAT(got_[kAnna], ElementsAre("e1", large));
}

TEST_F(OutboxTest, KeepsNoPreviews) {
  Outbox box = outbox(10, 10, 1000);
  EXPECT_EQ(box.preview(kAnna, "p1"), Sent::full);
  EXPECT_FALSE(box.waiting());
  (void)box.event(kAnna, "e1");
  room_[kAnna] = 100;
  EXPECT_EQ(box.preview(kAnna, "p2"), Sent::full) << "would overtake the event";
  flush(box);
  EXPECT_EQ(box.preview(kAnna, "p3"), Sent::yes);
  EXPECT_THAT(got_[kAnna], ElementsAre("e1", "p3"));
  EXPECT_EQ(box.dropped(), 0U) << "previews are counted by who sends them";
}

TEST_F(OutboxTest, KeepsNothingForAClientThatIsGone) {
  Outbox box = outbox(10, 10, 1000);
  gone_ = {kAnna};
  EXPECT_EQ(box.answer(kAnna, "a"), Sent::gone);
  EXPECT_EQ(box.event(kAnna, "e"), Sent::gone);
  EXPECT_EQ(box.preview(kAnna, "p"), Sent::gone);
  EXPECT_FALSE(box.waiting());
}

TEST_F(OutboxTest, ForgetsAClientThatGoesWhileSomethingWaits) {
  Outbox box = outbox(1, 10, 1000);
  for (const char* event : {"e1", "e2"}) (void)box.event(kAnna, event);
  (void)box.event(kBen, "e1");
  gone_ = {kAnna};
  flush(box);
  EXPECT_THAT(told_gone_, ElementsAre(kAnna));
  EXPECT_TRUE(box.waiting()) << "Ben's";
  room_[kBen] = 1;
  flush(box);
  EXPECT_THAT(told_gone_, ElementsAre(kAnna)) << "told once";
  EXPECT_FALSE(box.waiting());
  // One of the same name begins anew.
  gone_ = {};
  room_[kAnna] = 1;
  EXPECT_EQ(box.event(kAnna, "e9"), Sent::yes);
  EXPECT_THAT(got_[kAnna], ElementsAre("e9"));
}

TEST_F(OutboxTest, ASlowClientCostsTheOthersNothing) {
  Outbox box = outbox(2, 2, 1000);
  room_[kBen] = 1000;
  for (int i = 0; i < 100; ++i) {
    (void)box.event(kAnna, "e" + std::to_string(i));
    EXPECT_EQ(box.event(kBen, "e" + std::to_string(i)), Sent::yes);
  }
  EXPECT_EQ(got_[kBen].size(), 100U);
  EXPECT_EQ(box.dropped(), 98U);
}

// Whatever the pace of the clients: what was taken arrives, once and in order; what was not is counted.
TEST_F(OutboxTest, AtAnyPaceWhatWasTakenArrivesInOrder) {
  std::mt19937_64 random(test::seed(41));
  // It warns of every gap, and here are thousands.
  base::set_log_level(base::LogLevel::error);
  Outbox box = outbox(5, 7, 200);
  std::map<ClientId, std::vector<std::string>> taken;
  std::size_t refused = 0;
  const std::vector<ClientId> clients{kAnna, kBen, {0, "ben"}};
  for (int i = 0; i < 20'000; ++i) {
    const ClientId& client = clients[random() % clients.size()];
    const std::string bytes = std::to_string(i) + std::string(random() % 40, '.');
    switch (random() % 6) {
      case 0:
      case 1: {
        const Sent sent = box.answer(client, bytes);
        sent == Sent::yes ? taken[client].push_back(bytes) : void(++refused);
        break;
      }
      case 2:
      case 3: {
        const Sent sent = box.event(client, bytes);
        sent == Sent::yes ? taken[client].push_back(bytes) : void(++refused);
        break;
      }
      case 4:
        if (box.preview(client, bytes) == Sent::yes) taken[client].push_back(bytes);
        break;
      default:
        room_[client] += random() % 9;
        flush(box);
        break;
    }
  }
  for (const ClientId& client : clients) room_[client] = 1000;
  flush(box);
  EXPECT_FALSE(box.waiting());
  for (const ClientId& client : clients) {
    EXPECT_GT(taken[client].size(), 1000U);
    EXPECT_EQ(got_[client], taken[client]);
  }
  EXPECT_GT(refused, 100U);
  EXPECT_EQ(box.dropped(), refused);
  base::set_log_level(base::LogLevel::info);
}

}  // namespace
}  // namespace rig::protocol
