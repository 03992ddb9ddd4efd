// The rule of the bus: an answer that is late, or comes twice, or is broken, never passes for the answer to
// another question; and one drive that is off does not hold up the others.
#include "drivers/modbus_axis/bus.h"

#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mutex>
#include <random>
#include <thread>

#include "sim/wire/modbus_line.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::drivers::modbus {
namespace {

using base::ErrorCode;
using sim::wire::ModbusLine;
using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;

// Every register holds its own address, so that each answer says which question it belongs to; what is
// written is kept in order.
class Echo final : public sim::wire::ModbusRegisters {
 public:
  std::optional<Words> read(bool, std::uint16_t address, std::size_t count) override {
    Words words;
    for (std::size_t i = 0; i < count; ++i) words.push_back(static_cast<std::uint16_t>(address + i));
    return words;
  }
  std::optional<sim::wire::ModbusException> write(std::uint16_t address, const Words& words) override {
    const std::lock_guard lock(mutex_);
    written_.emplace_back(address, words);
    return std::nullopt;
  }
  std::vector<std::pair<std::uint16_t, Words>> written() {
    const std::lock_guard lock(mutex_);
    return written_;
  }

 private:
  std::mutex mutex_;
  std::vector<std::pair<std::uint16_t, Words>> written_;
};

constexpr milliseconds kAnswer{60};

struct OnALine {
  explicit OnALine(bool tcp) {
    const ModbusLine::Slaves slaves{{1, &first}, {2, &second}};
    if (tcp) {
      auto made = sim::wire::make_tcp_line(slaves);
      settings.host = "127.0.0.1";
      settings.tcp_port = made->port();
      line = std::move(made);
    } else {
      line = sim::wire::make_rtu_line(folder / "line", std::chrono::microseconds(1750), slaves);
      settings.serial.path = (folder / "line").string();
      settings.serial.baud = 38400;
      settings.gap = silent_interval(38400);
    }
    settings.answer = kAnswer;
    bus = std::make_unique<Bus>(settings, RetryPolicy{3, kAnswer}, *clock);
  }

  const test::TemporaryFolder folder;
  const std::unique_ptr<base::Clock> clock = base::make_system_clock();
  Echo first, second;
  WireSettings settings;
  std::unique_ptr<ModbusLine> line;
  std::unique_ptr<Bus> bus;
};

class BusOver : public testing::TestWithParam<bool>, public OnALine {
 protected:
  BusOver() : OnALine(GetParam()) {}
  Peer peer_{1, true, {{Table::holding, 0x10, 1}, {Table::holding, 0x20, 2}}};
  Peer other_{2, false, {{Table::holding, 0x10, 1}}};
};

INSTANTIATE_TEST_SUITE_P(Wires, BusOver, testing::Bool(),
                         [](const auto& wire) { return wire.param ? "Tcp" : "Rtu"; });

TEST_P(BusOver, ReadsAndWrites) {
  const auto words = bus->read(peer_, {Table::holding, 0x0123, 3});
  ASSERT_TRUE(words.has_value()) << words.error().text();
  EXPECT_THAT(*words, ElementsAre(0x0123, 0x0124, 0x0125));
  ASSERT_TRUE(bus->write(peer_, {7, {70}}).has_value());
  ASSERT_TRUE(bus->write(other_, {8, {80, 81}}).has_value());
  EXPECT_THAT(first.written(), ElementsAre(std::pair(std::uint16_t{7}, std::vector<std::uint16_t>{70})));
  EXPECT_THAT(second.written(), ElementsAre(std::pair(std::uint16_t{8}, std::vector<std::uint16_t>{80, 81})));
}

// Whatever the spoilt answers do, what read() hands back is the answer to what was asked.
TEST_P(BusOver, NoAnswerPassesForThatToAnotherQuestion) {
  std::mt19937_64 random(test::seed(20260727));
  const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  constexpr std::array kHow{ModbusLine::Spoil::late, ModbusLine::Spoil::missing, ModbusLine::Spoil::garbage,
                            ModbusLine::Spoil::duplicate};
  int right = 0, failed = 0;
  for (int i = 0; i < 60; ++i) {
    line->set_lateness(milliseconds(pick(10, 200)));
    // Mostly late ones: they are what this is about.
    line->spoil(kHow[static_cast<std::size_t>(std::max(0, pick(-3, 3)))], pick(0, 3));
    for (int question = 0; question < 3; ++question) {
      const Block block{Table::holding, static_cast<std::uint16_t>(pick(0, 60000)),
                        static_cast<std::uint16_t>(pick(1, 3))};
      const auto words = bus->read(peer_, block);
      if (!words) {
        ++failed;
        EXPECT_TRUE(words.error().code == ErrorCode::lost || words.error().code == ErrorCode::device)
            << words.error().text();
        // Asked again at once: that is when late answers do harm.
        peer_.lost.reset();
        continue;
      }
      ++right;
      ASSERT_EQ(words->front(), block.address) << "question " << question << " of round " << i;
      ASSERT_EQ(words->size(), block.count);
    }
  }
  EXPECT_GT(right, failed);
}

TEST_P(BusOver, ALateAnswerIsOutlivedWithinOneCall) {
  line->set_lateness(kAnswer * 3 / 2);
  line->spoil(ModbusLine::Spoil::late, 1);
  const auto words = bus->read(peer_, {Table::holding, 0x0777, 2});
  ASSERT_TRUE(words.has_value()) << words.error().text();
  EXPECT_EQ(words->front(), 0x0777);
}

TEST_P(BusOver, AnExceptionIsNotAskedAgain) {
  line->refuse(sim::wire::ModbusException::illegal_address, 1);
  const int before = line->requests();
  const auto words = bus->read(peer_, {Table::holding, 0x0777, 2});
  ASSERT_FALSE(words.has_value());
  EXPECT_EQ(words.error().code, ErrorCode::device);
  EXPECT_THAT(words.error().text(), HasSubstr("Illegal data address"));
  EXPECT_THAT(words.error().text(), HasSubstr("0x0777"));
  EXPECT_EQ(line->requests(), before + 1);
}

TEST_P(BusOver, ABusyDriveIsAskedAgain) {
  line->refuse(sim::wire::ModbusException::busy, 1);
  const auto words = bus->read(peer_, {Table::holding, 0x0777, 2});
  EXPECT_TRUE(words.has_value()) << words.error().text();
  line->refuse(sim::wire::ModbusException::busy, 20);
  const auto never = bus->read(peer_, {Table::holding, 0x0777, 2});
  ASSERT_FALSE(never.has_value());
  EXPECT_EQ(never.error().code, ErrorCode::device);
}

TEST_P(BusOver, ADriveThatIsOffIsLostAndHoldsNobodyUp) {
  line->set_off(1, true);
  const auto lost = bus->read(peer_, {Table::holding, 1, 1});
  ASSERT_FALSE(lost.has_value());
  EXPECT_EQ(lost.error().code, ErrorCode::lost);
  EXPECT_EQ(peer_.times_lost, 1);
  // Asked again at once it is lost at once.
  const auto began = std::chrono::steady_clock::now();
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(bus->read(peer_, {Table::holding, 1, 1}).has_value());
  EXPECT_LT(std::chrono::steady_clock::now() - began, kAnswer);
  EXPECT_TRUE(bus->read(other_, {Table::holding, 2, 1}).has_value());
  EXPECT_EQ(bus->times_opened(), 1);
  line->set_off(1, false);
  bool back = false;
  for (int i = 0; i < 100 && !back; ++i) {
    back = bus->read(peer_, {Table::holding, 3, 1}).has_value();
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_TRUE(back);
}

TEST_P(BusOver, WhatMayNotBeDoneTwiceIsSentOnce) {
  ASSERT_TRUE(bus->write_once(peer_, {0x40, {1}}).has_value());
  line->spoil(ModbusLine::Spoil::missing, 1);
  const auto open = bus->write_once(peer_, {0x40, {2}});
  ASSERT_FALSE(open.has_value());
  EXPECT_EQ(open.error().code, ErrorCode::device);
  EXPECT_THAT(open.error().text(), HasSubstr("not sent twice"));
  ASSERT_TRUE(bus->write_once(peer_, {0x40, {3}}).has_value());
  EXPECT_EQ(first.written().size(), 3U);
}

TEST_P(BusOver, AStopGoesOutToADriveThatIsLost) {
  line->set_off(1, true);
  EXPECT_FALSE(bus->read(peer_, {Table::holding, 1, 1}).has_value());
  line->set_off(1, false);
  EXPECT_TRUE(bus->write_at_once(peer_, {0x6002, {0x40}}).has_value());
  EXPECT_THAT(first.written(),
              ElementsAre(std::pair(std::uint16_t{0x6002}, std::vector<std::uint16_t>{0x40})));
}

TEST_P(BusOver, AStopIsSentAtOnceAfterALostAnswer) {
  line->spoil(ModbusLine::Spoil::missing, 3);
  EXPECT_FALSE(bus->write(peer_, {5, {50}}).has_value());
  const auto began = std::chrono::steady_clock::now();
  EXPECT_TRUE(bus->write_at_once(peer_, {6, {60}}).has_value());
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(1));
  EXPECT_EQ(first.written().back().first, 6);
}

TEST_P(BusOver, ALineThatWasCutComesBack) {
  EXPECT_TRUE(bus->read(peer_, {Table::holding, 1, 1}).has_value());
  line->cut();
  const auto gone = bus->read(peer_, {Table::holding, 1, 1});
  ASSERT_FALSE(gone.has_value());
  EXPECT_EQ(gone.error().code, ErrorCode::lost);
  line->restore();
  bool back = false;
  for (int i = 0; i < 200 && !back; ++i) {
    back = bus->read(peer_, {Table::holding, 3, 1}).has_value();
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_TRUE(back);
  EXPECT_EQ(bus->times_opened(), 2);
}

// The question that clears a doubt.
TEST(ClearingQuestion, HasAnAnswerThatIsNotAwaited) {
  Peer peer{1, true, {{Table::holding, 0x10, 1}, {Table::holding, 0x20, 2}}};
  const base::Time t{};
  peer.doubts = {{1, t + milliseconds(1)}};
  EXPECT_EQ(clearing_question(peer).count, 2);
  peer.doubts = {{2, t + milliseconds(1)}};
  EXPECT_EQ(clearing_question(peer).count, 1);
  peer.doubts = {{2, t + milliseconds(1)}, {1, t + milliseconds(2)}};
  EXPECT_EQ(clearing_question(peer).count, 3);
  // All may yet come: the one doubted longest ago.
  peer.doubts = {{2, t + milliseconds(1)}, {1, t + milliseconds(2)}, {3, t + milliseconds(3)}};
  EXPECT_EQ(clearing_question(peer).count, 2);
  peer.doubts.push_back({2, t + milliseconds(4)});
  EXPECT_EQ(clearing_question(peer).count, 1);
}

TEST(ClearingQuestion, MayBeAPartOfABlock) {
  Peer peer{1, true, {{Table::holding, 0x7C, 4}, {Table::holding, 0xCC, 4}}};
  peer.doubts = {{4, base::Time{milliseconds(1)}}};
  const Block question = clearing_question(peer);
  EXPECT_LT(question.count, 4);
}

}  // namespace
}  // namespace rig::drivers::modbus
