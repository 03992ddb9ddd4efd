// What goes over the wire for each command, against the examples of the guide; repeating, and giving up.
#include "drivers/tic_axis/link.h"

#include <deque>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rig::drivers::tic {
namespace {

using base::ErrorCode;
using base::fail;
using base::Result;
using std::chrono::milliseconds;
using testing::ElementsAre;

// "40 E0 02D2 4996": type, request, value, index, and the length of what is read.
std::string text_of(const ControlRequest& r, int length = 0) {
  return fmt::format("{:02X} {:02X} {:04X} {:04X} {}", r.type, r.request, r.value, r.index, length);
}

class Recorded final : public Transport {
 public:
  Result<void> control_out(const ControlRequest& request, milliseconds /*within*/) override {
    sent.push_back(text_of(request));
    if (errors.empty()) return {};
    return next_error();
  }
  Result<std::vector<std::uint8_t>> control_in(const ControlRequest& request, std::uint16_t length,
                                               milliseconds /*within*/) override {
    sent.push_back(text_of(request, length));
    if (!errors.empty()) return next_error();
    if (answers.empty()) return std::vector<std::uint8_t>(length);
    auto answer = answers.front();
    answers.pop_front();
    return answer;
  }
  const Identity& identity() const override { return identity_; }

  std::vector<std::string> sent;
  std::deque<ErrorCode> errors;
  std::deque<std::vector<std::uint8_t>> answers;

 private:
  tl::unexpected<base::Error> next_error() {
    const ErrorCode code = errors.front();
    errors.pop_front();
    return fail(code, "spoilt");
  }
  const Identity identity_{0x00B3, 0x0106, "1", "Tic 1"};
};

class TicLink : public testing::Test {
 protected:
  TicLink() {
    auto made = std::make_unique<Recorded>();
    wire = made.get();
    link = std::make_unique<Link>(std::move(made), RetryPolicy{3, milliseconds(200)});
  }
  Recorded* wire = nullptr;
  std::unique_ptr<Link> link;
};

TEST_F(TicLink, SendsTheExamplesOfTheGuide) {
  ASSERT_TRUE(link->quick(Command::halt_and_hold));
  ASSERT_TRUE(link->write32(Command::set_target_position, 1'234'567'890));
  ASSERT_TRUE(link->set_setting(kStepModeOffset, 3));
  EXPECT_THAT(wire->sent, ElementsAre("40 89 0000 0000 0", "40 E0 02D2 4996 0", "40 13 0003 0041 0"));
}

TEST_F(TicLink, SplitsNumbersIntoHalves) {
  ASSERT_TRUE(link->write32(Command::set_target_velocity, -2));
  ASSERT_TRUE(link->write32(Command::set_max_speed, 500'000'000));
  ASSERT_TRUE(link->write7(Command::go_home, 1));
  ASSERT_TRUE(link->quick(Command::reset_command_timeout));
  EXPECT_THAT(wire->sent, ElementsAre("40 E3 FFFE FFFF 0", "40 E6 6500 1DCD 0", "40 97 0001 0000 0",
                                      "40 8C 0000 0000 0"));
}

TEST_F(TicLink, ReadsBlocksWhole) {
  ASSERT_TRUE(link->variables());
  ASSERT_TRUE(link->settings());
  wire->answers.push_back({0x44, 0, 0x10, 0});
  const auto errors = link->take_errors_occurred();
  ASSERT_TRUE(errors);
  EXPECT_EQ(*errors, error::low_vin | error::command_timeout | error::encoder_skip);
  EXPECT_THAT(wire->sent, ElementsAre("C0 A1 0000 0000 85", "C0 A8 0000 0000 105", "C0 A2 0000 0004 4"));
}

TEST_F(TicLink, AsksAgainWhereAnAnswerIsLateOrGarbled) {
  wire->errors = {ErrorCode::timeout, ErrorCode::damaged};
  EXPECT_TRUE(link->quick(Command::energize));
  EXPECT_EQ(wire->sent.size(), 3U);
  // A block that is short, and one that makes no sense.
  wire->answers = {std::vector<std::uint8_t>(7), std::vector<std::uint8_t>(0x55, 0xEE)};
  EXPECT_TRUE(link->variables());
  EXPECT_EQ(wire->sent.size(), 6U);
  EXPECT_FALSE(link->gone());
}

TEST_F(TicLink, SilenceIsLostAndNotGone) {
  wire->errors.assign(3, ErrorCode::timeout);
  const auto silent = link->variables();
  ASSERT_FALSE(silent);
  EXPECT_EQ(silent.error().code, ErrorCode::lost);
  EXPECT_FALSE(link->gone());
  wire->errors.assign(3, ErrorCode::damaged);
  EXPECT_EQ(link->settings().error().code, ErrorCode::device);
  EXPECT_FALSE(link->gone());
}

TEST_F(TicLink, APulledPlugIsGoneAtOnce) {
  wire->errors = {ErrorCode::lost};
  EXPECT_EQ(link->quick(Command::energize).error().code, ErrorCode::lost);
  EXPECT_EQ(wire->sent.size(), 1U);
  EXPECT_TRUE(link->gone());
}

TEST_F(TicLink, AStallNamesTheCommand) {
  wire->errors = {ErrorCode::device};
  const auto refused = link->quick(Command::exit_safe_start);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::device);
  EXPECT_THAT(refused.error().what, testing::HasSubstr("'exit safe start'"));
  EXPECT_EQ(wire->sent.size(), 1U);
}

TEST_F(TicLink, AFeedingIsTriedOnce) {
  wire->errors = {ErrorCode::timeout};
  EXPECT_FALSE(link->feed());
  EXPECT_EQ(wire->sent.size(), 1U);
}

}  // namespace
}  // namespace rig::drivers::tic
