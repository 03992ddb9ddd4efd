#include "drivers/common/connection.h"

#include <gtest/gtest.h>

#include "tests/drivers/common/set_clock.h"

namespace rig::drivers {
namespace {

using base::ErrorCode;
using base::fail;
using base::Result;

struct Device {
  int number;
};

class ConnectionTest : public ::testing::Test {
 protected:
  Connection<Device> make() {
    return {[this]() -> Result<std::unique_ptr<Device>> {
              ++tries_;
              if (absent_) return fail(ErrorCode::io, "not plugged in", "/dev/x");
              return std::make_unique<Device>(Device{tries_});
            },
            clock_};
  }

  testing::SetClock clock_;
  bool absent_ = false;
  int tries_ = 0;
};

TEST_F(ConnectionTest, IsMadeAtTheFirstUseAndKept) {
  auto connection = make();
  EXPECT_FALSE(connection.is_open());
  EXPECT_EQ(tries_, 0);
  for (int i = 0; i < 3; ++i) {
    const auto number = connection.use([](Device& device) -> Result<int> { return device.number; });
    ASSERT_TRUE(number.has_value());
    EXPECT_EQ(*number, 1);
  }
  EXPECT_TRUE(connection.is_open());
  EXPECT_EQ(connection.times_opened(), 1);
}

TEST_F(ConnectionTest, EndsWithLostAndComesBack) {
  auto connection = make();
  const auto lost = connection.use([](Device&) -> Result<int> { return fail(ErrorCode::lost, "gone"); });
  EXPECT_EQ(lost.error().code, ErrorCode::lost);
  EXPECT_FALSE(connection.is_open());
  EXPECT_TRUE(connection.get().has_value());
  EXPECT_EQ(connection.times_opened(), 2);
}

TEST_F(ConnectionTest, OtherErrorsLeaveItOpen) {
  auto connection = make();
  (void)connection.use([](Device&) -> Result<int> { return fail(ErrorCode::device, "too hot"); });
  EXPECT_TRUE(connection.is_open());
}

TEST_F(ConnectionTest, WhatIsNotThereIsLookedForOnceInAWhile) {
  absent_ = true;
  auto connection = make();
  for (int i = 0; i < 5; ++i) {
    const auto held = connection.get();
    ASSERT_FALSE(held.has_value());
    EXPECT_EQ(held.error().code, ErrorCode::lost);
    EXPECT_EQ(held.error().what, "not plugged in");
    EXPECT_EQ(held.error().where, "/dev/x");
  }
  EXPECT_EQ(tries_, 1);
  clock_.pass(1.1);
  absent_ = false;
  EXPECT_TRUE(connection.get().has_value());
  EXPECT_EQ(tries_, 2);
  EXPECT_EQ(connection.times_opened(), 1);
}

}  // namespace
}  // namespace rig::drivers
