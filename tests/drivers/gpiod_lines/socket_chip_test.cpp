// What a socket answers in the place of the kernel, byte by byte.
#include "drivers/gpiod_lines/socket_chip.h"

#include <gtest/gtest.h>

namespace rig::drivers::gpiod_lines {
namespace {

using base::ErrorCode;

TEST(SocketAnswer, OkAndWhatFollows) {
  EXPECT_EQ(read_answer("ok").value(), "");
  EXPECT_EQ(read_answer("ok 1").value(), "1");
  EXPECT_EQ(read_answer("ok 1@2 0@3").value(), "1@2 0@3");
}

TEST(SocketAnswer, AnErrorNamesWhatTheKernelWouldSay) {
  const auto busy = read_answer("error 16");
  ASSERT_FALSE(busy);
  EXPECT_EQ(busy.error().code, ErrorCode::busy);
  EXPECT_EQ(busy.error().what, "the line is not to be had: Device or resource busy");
  EXPECT_EQ(read_answer("error 19").error().code, ErrorCode::io);
}

TEST(SocketAnswer, NonsenseIsDamaged) {
  for (const char* text :
       {"", "o", "okay", "ok1", "error", "error ", "error x", "error -3", "error 0", "error 5 "}) {
    const auto answer = read_answer(text);
    ASSERT_FALSE(answer) << text;
    EXPECT_EQ(answer.error().code, ErrorCode::damaged) << text;
  }
}

TEST(SocketAnswer, LevelsAndOffsets) {
  EXPECT_TRUE(read_level("1").value());
  EXPECT_FALSE(read_level("0").value());
  for (const char* text : {"", "2", "01", "1 "}) EXPECT_FALSE(read_level(text)) << text;
  EXPECT_EQ(read_offset("12").value(), 12U);
  for (const char* text : {"", "-1", "1 ", "x", "99999999999"}) EXPECT_FALSE(read_offset(text)) << text;
}

TEST(SocketAnswer, Edges) {
  EXPECT_TRUE(read_edges("").value().empty());
  const auto edges = read_edges("1@12 0@1700000000000000000").value();
  ASSERT_EQ(edges.size(), 2U);
  EXPECT_TRUE(edges[0].active);
  EXPECT_EQ(edges[0].at_ns, 12);
  EXPECT_FALSE(edges[1].active);
  EXPECT_EQ(edges[1].at_ns, 1'700'000'000'000'000'000);
  for (const char* text :
       {" ", "1", "1@", "@1", "2@1", "1@1 ", "1@1  0@2", "1@1,0@2", "1@-1", "1@99999999999999999999"}) {
    EXPECT_FALSE(read_edges(text)) << text;
  }
  std::string many = "1@1";
  for (std::size_t i = 0; i < 4 * kEdgeQueue; ++i) many += " 0@1";
  EXPECT_FALSE(read_edges(many));
}

}  // namespace
}  // namespace rig::drivers::gpiod_lines
