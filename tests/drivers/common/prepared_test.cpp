#include "drivers/common/prepared.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "tests/drivers/common/set_clock.h"

namespace rig::drivers {
namespace {

using base::ErrorCode;
using base::fail;
using base::Result;

struct World {
  bool line = true;   // the line is there
  bool deaf = false;  // and nobody answers
  int shares = 3;     // calls that setting up takes
  int shouted = 0;
  int calls = 0;
  Deadline call_ends{};
  std::chrono::milliseconds share{0};  // how long one takes
};

constexpr RetryPolicy kPolicy{3, std::chrono::milliseconds(50), std::chrono::milliseconds(200)};

class Device {
 public:
  explicit Device(World& world) : world_(world), left_(world.shares) {}
  Result<bool> set_up() {
    if (world_.deaf) return fail(ErrorCode::lost, "no answer");
    std::this_thread::sleep_for(world_.share);
    if (left_ > 0) --left_;
    return is_set_up();
  }
  [[nodiscard]] bool is_set_up() const { return left_ == 0; }
  void begin_call(Deadline ends) {
    world_.call_ends = ends;
    ++world_.calls;
  }
  Result<int> value() {
    if (world_.deaf) return fail(ErrorCode::lost, "no answer");
    return 7;
  }
  Result<void> shout() {
    ++world_.shouted;
    return {};
  }
  Result<void> stop() { return {}; }

 private:
  World& world_;
  int left_;
};

class PreparedTest : public ::testing::Test {
 protected:
  Result<int> value() {
    return prepared_.use([](Device& device) { return device.value(); });
  }
  Result<void> stop() {
    return prepared_.use_at_once([](Device& device) { return device.stop(); },
                                 [](Device& device) { return device.shout(); });
  }

  World world_;
  testing::SetClock clock_;
  int back_ = 0;
  Prepared<Device> prepared_{[this]() -> Result<std::unique_ptr<Device>> {
                               if (!world_.line) return fail(ErrorCode::lost, "not plugged in");
                               return std::make_unique<Device>(world_);
                             },
                             clock_, kPolicy, "/dev/x", [this] { ++back_; }};
};

TEST_F(PreparedTest, IsLostUntilItIsSetUp) {
  for (int i = 0; i < 2; ++i) {
    const auto early = value();
    ASSERT_FALSE(early.has_value());
    EXPECT_EQ(early.error().code, ErrorCode::lost);
    EXPECT_THAT(early.error().text(), ::testing::HasSubstr("/dev/x: it is being set up"));
  }
  EXPECT_EQ(*value(), 7);
  EXPECT_EQ(*value(), 7);
  EXPECT_EQ(back_, 0);
}

TEST_F(PreparedTest, IsWaitedForAtOpening) {
  const auto device = prepared_.wait(std::chrono::milliseconds(0));
  ASSERT_TRUE(device.has_value());
  EXPECT_TRUE((*device)->is_set_up());
}

TEST_F(PreparedTest, NothingIsWaitedForWithoutALine) {
  world_.line = false;
  const auto device = prepared_.wait(std::chrono::hours(1));
  ASSERT_FALSE(device.has_value());
  EXPECT_EQ(device.error().what, "not plugged in");
}

TEST_F(PreparedTest, WhatIsSilentIsWaitedForWithPatience) {
  world_.deaf = true;
  const auto began = std::chrono::steady_clock::now();
  const auto device = prepared_.wait(std::chrono::milliseconds(120));
  ASSERT_FALSE(device.has_value());
  EXPECT_EQ(device.error().what, "no answer");
  EXPECT_GE(std::chrono::steady_clock::now() - began, std::chrono::milliseconds(120));
}

TEST_F(PreparedTest, IsSetUpAnewAfterItWasLost) {
  ASSERT_TRUE(prepared_.wait(std::chrono::milliseconds(0)).has_value());
  world_.deaf = true;
  EXPECT_EQ(value().error().what, "no answer");
  EXPECT_EQ(value().error().what, "no answer");
  world_.deaf = false;
  EXPECT_FALSE(value().has_value());
  EXPECT_FALSE(value().has_value());
  EXPECT_EQ(back_, 0);
  EXPECT_EQ(*value(), 7);
  EXPECT_EQ(back_, 1);
}

TEST_F(PreparedTest, AStopIsShoutedBeforeItIsSetUp) {
  const auto early = stop();
  ASSERT_FALSE(early.has_value());
  EXPECT_EQ(early.error().code, ErrorCode::lost);
  EXPECT_EQ(world_.shouted, 1);
  ASSERT_TRUE(prepared_.wait(std::chrono::milliseconds(0)).has_value());
  EXPECT_TRUE(stop().has_value());
  EXPECT_EQ(world_.shouted, 1);
}

TEST_F(PreparedTest, EachCallKnowsWhenItHasToBeOver) {
  ASSERT_TRUE(prepared_.wait(std::chrono::milliseconds(0)).has_value());
  const auto began = std::chrono::steady_clock::now();
  const int before = world_.calls;
  EXPECT_EQ(*value(), 7);
  EXPECT_EQ(world_.calls, before + 1);
  EXPECT_GE(world_.call_ends, began + kPolicy.call);
  EXPECT_LE(world_.call_ends, std::chrono::steady_clock::now() + kPolicy.call);
  world_.call_ends = {};
  EXPECT_TRUE(stop().has_value());
  EXPECT_GE(world_.call_ends, began + kPolicy.call);
}

TEST_F(PreparedTest, ACallThatSettingUpHasUsedUpDoesNothingElse) {
  world_.shares = 1;
  world_.share = std::chrono::milliseconds(180);
  const auto early = value();
  ASSERT_FALSE(early.has_value());
  EXPECT_EQ(early.error().code, ErrorCode::lost);
  // It is set up all the same, and stays so.
  EXPECT_EQ(*value(), 7);
}

}  // namespace
}  // namespace rig::drivers
