// Orders to a simulated device that is a program, and their answers.
#include "sim/wire/order_lines.h"

#include <gtest/gtest.h>

namespace rig::sim::wire {
namespace {

TEST(OrderLines, EachOrderHasItsAnswer) {
  bool plugged = true, stuck = false;
  const OrderedDevice device{"device",
                             [&]() -> base::Result<void> {
                               if (stuck) return base::fail(base::ErrorCode::io, "the port is taken");
                               plugged = true;
                               return {};
                             },
                             [&] { plugged = false; },
                             [](const std::string& order) -> base::Result<std::string> {
                               if (order == "state") return std::string("position 3");
                               if (order == "stall 1") return std::string();
                               return base::fail(base::ErrorCode::bad_input, "not understood");
                             }};
  EXPECT_EQ(obey_order(device, "unplug"), "ok");
  EXPECT_FALSE(plugged);
  EXPECT_EQ(obey_order(device, "plug"), "ok");
  EXPECT_TRUE(plugged);
  EXPECT_EQ(obey_order(device, "state"), "position 3");
  EXPECT_EQ(obey_order(device, "stall 1"), "ok");
  testing::internal::CaptureStderr();
  EXPECT_EQ(obey_order(device, "dance"), "refused");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "device: not understood\n");
  stuck = true;
  testing::internal::CaptureStderr();
  EXPECT_EQ(obey_order(device, "plug"), "refused");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "device: the port is taken\n");
}

}  // namespace
}  // namespace rig::sim::wire
