// The Turner's words against what its protocol says, byte for byte.
#include "share/examples/driver/protocol.h"

#include <gtest/gtest.h>

namespace rig::drivers::turner {
namespace {

using base::ErrorCode;

// '3' 'Q' are 51 and 81: their sum is 132, 84 in hexadecimal.
TEST(TurnerProtocol, ARequestHasTagTextAndSum) {
  EXPECT_EQ(request(3, "Q"), "3Q*84\n");
  EXPECT_EQ(request(9, "S"), "9S*8C\n");
  EXPECT_EQ(request(3, "M 1200 500 2000"), "3M 1200 500 2000*FA\n");
}

TEST(TurnerProtocol, AnAnswerIsForItsOwnRequestAndWhole) {
  EXPECT_EQ(answer(3, "3Q*84"), "Q");
  EXPECT_EQ(answer(3, "3M ok*7A"), "M ok");
  for (const char* wrong : {"", "*", "*00", "3Q", "3Q*", "3Q*85", "3Q*8c", "3Q*84 ", "\xff\xff\xff\xff"}) {
    const auto read = answer(3, wrong);
    ASSERT_FALSE(read.has_value()) << wrong;
    EXPECT_EQ(read.error().code, ErrorCode::damaged) << wrong;
  }
  ASSERT_FALSE(answer(4, "3Q*84").has_value());
}

TEST(TurnerProtocol, AReportHasCountsAndFlags) {
  const auto moving = report("Q -1200 5");
  ASSERT_TRUE(moving.has_value());
  EXPECT_EQ(moving->counts, -1200);
  EXPECT_TRUE(moving->moving);
  EXPECT_TRUE(moving->energised);
  EXPECT_FALSE(moving->homed || moving->at_low_limit || moving->at_high_limit || moving->fault);
  const auto limit = report("Q 7 58");
  ASSERT_TRUE(limit.has_value());
  EXPECT_TRUE(limit->homed && limit->at_low_limit && limit->at_high_limit && limit->fault);
  EXPECT_FALSE(limit->moving || limit->energised);
  for (const char* wrong :
       {"", "Q", "Q 1", "Q 1 64", "Q 1 -1", "Q 1 2 3", "Q  1 2", "Q 99999999999 0", "S ok"}) {
    EXPECT_FALSE(report(wrong).has_value()) << wrong;
  }
}

TEST(TurnerProtocol, ANoIsTheErrorThatItMeans) {
  EXPECT_TRUE(verdict('M', "M ok").has_value());
  const auto code = [](std::string_view text) { return verdict('M', text).error().code; };
  EXPECT_EQ(code("M no unhomed"), ErrorCode::refused);
  EXPECT_EQ(code("M no limit"), ErrorCode::refused);
  EXPECT_EQ(code("M no busy"), ErrorCode::busy);
  EXPECT_EQ(code("M no fault"), ErrorCode::device);
  EXPECT_EQ(code("M no off"), ErrorCode::device);
  for (const char* wrong : {"", "M", "M okay", "M nothing", "S ok"})
    EXPECT_EQ(code(wrong), ErrorCode::damaged) << wrong;
}

}  // namespace
}  // namespace rig::drivers::turner
