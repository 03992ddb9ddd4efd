// A lamp's hours: counted, kept, and never lost by more than a minute.
#include "drivers/common/lamp_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/temporary_folder.h"
#include "tests/drivers/common/set_clock.h"

namespace rig::drivers {
namespace {

using ::testing::HasSubstr;

std::vector<std::string> logged;
void log_it(base::LogLevel /*level*/, std::string_view message) {
  logged.emplace_back(message);
}

class Lamp : public ::testing::Test {
 protected:
  Lamp() { logged.clear(); }
  [[nodiscard]] LampRecord open() {
    auto lamp = LampRecord::open(file_, clock_, &log_it);
    EXPECT_TRUE(lamp) << lamp.error().text();
    return std::move(*lamp);
  }
  [[nodiscard]] std::string kept() const { return test::bytes_in(file_); }

  test::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "light.hours";
  testing::SetClock clock_;
};

TEST_F(Lamp, ANewOneHasNoHours) {
  const auto lamp = open();
  EXPECT_DOUBLE_EQ(lamp.hours(), 0);
  EXPECT_DOUBLE_EQ(lamp.lit_for_s(), 0);
}

TEST_F(Lamp, HoursAreTheTimeBetweenLooks) {
  auto lamp = open();
  lamp.note(false);
  clock_.pass(1800);
  lamp.note(true);
  EXPECT_DOUBLE_EQ(lamp.hours(), 0);
  clock_.pass(1800);
  EXPECT_DOUBLE_EQ(lamp.lit_for_s(), 1800);
  lamp.note(true);
  EXPECT_DOUBLE_EQ(lamp.hours(), 0.5);
  clock_.pass(1800);
  lamp.note(false);
  EXPECT_DOUBLE_EQ(lamp.hours(), 1);
  EXPECT_DOUBLE_EQ(lamp.lit_for_s(), 0);
  clock_.pass(1800);
  lamp.note(false);
  EXPECT_DOUBLE_EQ(lamp.hours(), 1);
}

TEST_F(Lamp, TheyAreKeptBetweenRuns) {
  {
    auto lamp = open();
    lamp.note(true);
    clock_.pass(3600);
    lamp.note(false);
  }
  EXPECT_EQ(kept(), "lamp 1\nhours 1\nlit_at_ns 0\n");
  clock_.pass(3600);
  auto lamp = open();
  lamp.note(true);
  clock_.pass(1800);
  lamp.note(true);
  EXPECT_DOUBLE_EQ(lamp.hours(), 1.5);
}

TEST_F(Lamp, WhileItBurnsTheyAreOnTheDiskOnceAMinute) {
  auto lamp = open();
  lamp.note(true);
  const std::string lit = kept();
  EXPECT_THAT(lit, HasSubstr("hours 0\n"));
  for (int s = 0; s < 59; ++s) {
    clock_.pass(1);
    lamp.note(true);
  }
  EXPECT_EQ(kept(), lit);
  clock_.pass(1);
  lamp.note(true);
  EXPECT_NE(kept(), lit);
  EXPECT_THAT(kept(), HasSubstr("hours 0.0166"));
}

TEST_F(Lamp, OneThatBurntOnBetweenRunsIsCountedUpToTwelveHours) {
  {
    auto lamp = open();
    lamp.note(true);
  }
  clock_.pass(2 * 3600);
  {
    auto lamp = open();
    EXPECT_DOUBLE_EQ(lamp.lit_for_s(), 0);
    lamp.note(true);
    EXPECT_DOUBLE_EQ(lamp.hours(), 2);
    EXPECT_DOUBLE_EQ(lamp.lit_for_s(), 0);  // nobody saw that it did not go out
  }
  clock_.pass(100 * 3600);
  auto lamp = open();
  lamp.note(true);
  EXPECT_DOUBLE_EQ(lamp.hours(), 14);
}

TEST_F(Lamp, OneThatWasOutAtTheNextRunIsNotCounted) {
  {
    auto lamp = open();
    lamp.note(true);
    clock_.pass(360);
    lamp.note(true);
  }
  clock_.pass(7200);
  auto lamp = open();
  lamp.note(false);
  EXPECT_DOUBLE_EQ(lamp.hours(), 0.1);
}

TEST_F(Lamp, OneThatWasOutOfSightBeginsToWarmUpAgain) {
  auto lamp = open();
  lamp.note(true);
  clock_.pass(3600);
  lamp.note(true);
  lamp.forget();
  EXPECT_DOUBLE_EQ(lamp.lit_for_s(), 0);
  clock_.pass(3600);
  lamp.note(true);
  EXPECT_DOUBLE_EQ(lamp.hours(), 2);
  clock_.pass(60);
  EXPECT_DOUBLE_EQ(lamp.lit_for_s(), 60);
}

TEST_F(Lamp, AClockThatWasSetBackCountsNothing) {
  {
    auto lamp = open();
    lamp.note(true);
  }
  clock_.pass(-3600);
  auto lamp = open();
  lamp.note(true);
  EXPECT_DOUBLE_EQ(lamp.hours(), 0);
}

TEST_F(Lamp, ADamagedRecordIsNotTakenForANewLamp) {
  for (const char* text : {"", "lamp 1\n", "lamp 2\nhours 1\nlit_at_ns 0\n", "lamp 1\nhours x\nlit_at_ns 0\n",
                           "lamp 1\nhours -1\nlit_at_ns 0\n", "lamp 1\nhours inf\nlit_at_ns 0\n",
                           "lamp 1\nhours 1\nlit_at_ns -5\n", "lamp 1\nhours 1\nlit_at_ns 0\nmore\n",
                           "lamp 1\nhours 1\nlit_at_ns 0"}) {
    test::put_bytes(file_, text);
    const auto lamp = LampRecord::open(file_, clock_, &log_it);
    ASSERT_FALSE(lamp) << text;
    EXPECT_EQ(lamp.error().code, base::ErrorCode::damaged) << text;
  }
}

TEST_F(Lamp, ADiskThatRefusesIsLoggedOnceAndTheLampGoesOn) {
  auto lamp = open();
  std::filesystem::create_directory(file_.string() + ".part");  // nothing can be written beside it
  lamp.note(true);
  EXPECT_EQ(logged.size(), 1U);
  clock_.pass(100);
  lamp.note(true);
  EXPECT_EQ(logged.size(), 1U);
  EXPECT_THAT(logged[0], HasSubstr("the lamp's hours are not kept"));
  std::filesystem::remove(file_.string() + ".part");
  clock_.pass(100);
  lamp.note(false);
  EXPECT_THAT(kept(), HasSubstr("lit_at_ns 0"));
  EXPECT_EQ(logged.size(), 1U);
}

}  // namespace
}  // namespace rig::drivers
