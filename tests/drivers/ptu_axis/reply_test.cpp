// Against the transcripts of the manuals.
#include "drivers/ptu_axis/reply.h"

#include <gtest/gtest.h>
#include <vector>

namespace rig::drivers::ptu {
namespace {

using Kind = Reply::Kind;

std::vector<Reply> read(const std::string& bytes) {
  ReplyReader reader;
  reader.feed(bytes);
  std::vector<Reply> replies;
  while (auto reply = reader.next()) replies.push_back(*reply);
  return replies;
}

Reply only(const std::string& bytes) {
  const auto replies = read(bytes);
  EXPECT_EQ(replies.size(), 1U) << bytes;
  return replies.empty() ? Reply{} : replies.front();
}

Reply fine(std::string text, std::string before = {}) {
  return {Kind::fine, std::move(text), std::move(before)};
}

TEST(PtuReply, AMereStarIsDone) {
  for (const char* bytes : {"*\r", "*\n", "*\r\n", "* \r\n", "*  \r", "\r\n*\r\n"}) {
    EXPECT_EQ(only(bytes), fine("")) << bytes;
  }
}

TEST(PtuReply, TerseNumbers) {
  for (const char* bytes : {"* 0\r\n", "* 0\n", "* 0 \r\n", "*0\r"})
    EXPECT_EQ(only(bytes), fine("0")) << bytes;
  EXPECT_EQ(number_in(only("* -2500\r\n").text), -2500);
  EXPECT_EQ(number_in(only("* 185.1428\r\n").text), 185.1428);
  EXPECT_TRUE(is_terse("-2500"));
  EXPECT_TRUE(is_terse("185.1428"));
}

TEST(PtuReply, WordyNumbers) {
  const struct {
    const char* text;
    double number;
  } replies[] = {
      {"Current Pan position is -2500", -2500},
      {"Current pan position is 0", 0},
      {"Target Tilt position is 31", 31},
      {"185.1428 seconds arc per Pan position", 185.1428},
      {"92.5714 seconds arc per position", 92.5714},
      {"Minimum Pan position is -3090", -3090},
      {"Maximum Tilt position is 604", 604},
      {"Maximum Pan speed is 2902 positions/sec", 2902},
      {"Current Pan base speed is 1000 positions/sec", 1000},
  };
  for (const auto& reply : replies) {
    const Reply read = only(std::string("* ") + reply.text + "\r\n");
    EXPECT_EQ(read.kind, Kind::fine);
    EXPECT_EQ(number_in(read.text), reply.number) << reply.text;
    EXPECT_FALSE(is_terse(read.text)) << reply.text;
  }
  EXPECT_TRUE(is_wordy("Current Pan position is -2500"));
  EXPECT_FALSE(is_wordy("185.1428"));
  EXPECT_FALSE(is_wordy("x12"));
}

TEST(PtuReply, WhatIsNoNumber) {
  for (const char* text : {"", "ASCII terse mode", "-", ".", "e5"}) {
    if (std::string(text) == "e5") {
      EXPECT_EQ(number_in(text), 5);
      EXPECT_FALSE(is_terse(text));
      continue;
    }
    EXPECT_FALSE(number_in(text).has_value()) << text;
    EXPECT_FALSE(is_terse(text)) << text;
  }
  EXPECT_FALSE(is_terse("12k"));
}

TEST(PtuReply, AnEchoStandsBeforeTheMark) {
  EXPECT_EQ(only("PP * 22\r\n"), fine("22", "PP"));
  EXPECT_EQ(only("PP-2500 *\r\n"), fine("", "PP-2500"));
  EXPECT_EQ(only("F * ASCII terse mode\r\n"), fine("ASCII terse mode", "F"));
  EXPECT_EQ(only("PP3200 ! Maximum allowable Pan position is 3090\r\n"),
            (Reply{Kind::error, "Maximum allowable Pan position is 3090", "PP3200"}));
}

TEST(PtuReply, Errors) {
  for (const char* text :
       {"Maximum allowable Pan position is 3090", "Pan speed cannot exceed 2902 positions/sec",
        "Motor speed cannot be less than 31 pos/sec", "Illegal command", "Tilt axis error"}) {
    EXPECT_EQ(only(std::string("! ") + text + "\r\n"), (Reply{Kind::error, text, {}}));
  }
}

TEST(PtuReply, LimitsAloneAndGluedToAReply) {
  const Reply pan{Kind::limit, "P", {}};
  const Reply tilt{Kind::limit, "T", {}};
  EXPECT_EQ(read("!P\r\n"), (std::vector{pan}));
  EXPECT_EQ(read("!P* 0\r\n"), (std::vector{pan, fine("0")}));
  EXPECT_EQ(read("!P!T* -12\r\n"), (std::vector{pan, tilt, fine("-12")}));
  EXPECT_EQ(read("!p\r!t\r*\r"), (std::vector{pan, tilt, fine("")}));
  EXPECT_EQ(read("!T!T!P!P*\r\n"), (std::vector{tilt, tilt, pan, pan, fine("")}));
  EXPECT_EQ(read("!P! Illegal command\r\n"), (std::vector{pan, Reply{Kind::error, "Illegal command", {}}}));
}

TEST(PtuReply, AnErrorThatBeginsLikeALimitIsNone) {
  EXPECT_EQ(only("!Pan speed cannot exceed 2902\r\n"),
            (Reply{Kind::error, "Pan speed cannot exceed 2902", {}}));
}

TEST(PtuReply, Banners) {
  const auto replies = read(
      "\r\n\r\n### PAN-TILT CONTROLLER\r\n### v3.3.0, (C)2010-2011 FLIR Commercial Systems, Inc., "
      "All Rights Reserved\r\nInitializing...*\r\n");
  ASSERT_EQ(replies.size(), 3U);
  for (const Reply& reply : replies) EXPECT_EQ(reply.kind, Kind::banner) << reply.text;
  EXPECT_EQ(only("* Pan-Tilt Controller v2.12.1d1(C14/E), (C)2003 Directed Perception, Inc., All Rights "
                 "Reserved\r\n")
                .kind,
            Kind::banner);
}

TEST(PtuReply, AnythingElseIsNoise) {
  EXPECT_EQ(only("abc\r\n"), (Reply{Kind::noise, "abc", {}}));
  // Behind noise without an end a reply is whole.
  EXPECT_EQ(only("x*y!z* 185.1428\r\n"), fine("185.1428", "x*y!z"));
}

TEST(PtuReply, ALineWithoutAnEndDoesNotGrowForEver) {
  ReplyReader reader;
  int noise = 0;
  for (int i = 0; i < 100; ++i) {
    reader.feed(std::string(100, 'x'));
    while (auto reply = reader.next()) {
      EXPECT_EQ(reply->kind, Kind::noise);
      EXPECT_LE(reply->text.size(), 256U);
      ++noise;
    }
  }
  EXPECT_EQ(noise, 10000 / 256);
}

TEST(PtuReply, HowTheBytesAreCutMakesNoDifference) {
  const std::string bytes = "PP * 22\r\n!P* 0\r\n!T!T!P!P*\r\n! Illegal command\r\nrubbish\r\n* -5 \n";
  const auto whole = read(bytes);
  for (std::size_t piece = 1; piece < 7; ++piece) {
    ReplyReader reader;
    std::vector<Reply> replies;
    for (std::size_t i = 0; i < bytes.size(); i += piece) {
      reader.feed(bytes.substr(i, piece));
      while (auto reply = reader.next()) replies.push_back(*reply);
    }
    EXPECT_EQ(replies, whole) << piece;
  }
}

TEST(PtuReply, NothingIsHandedOutBeforeItsEnd) {
  ReplyReader reader;
  reader.feed("* 18");
  EXPECT_FALSE(reader.next().has_value());
  reader.feed("5\r");
  EXPECT_EQ(*reader.next(), fine("185"));
}

TEST(PtuReply, Temperatures) {
  EXPECT_NEAR(*temperature_c_in("Input 30 VDC @ 86 degF"), 30, 1e-9);
  EXPECT_NEAR(*temperature_c_in("Input 30 VDC @ -4 degF"), -20, 1e-9);
  EXPECT_NEAR(*temperature_c_in("Input 12.1 VDC @ 41.5 degC"), 41.5, 1e-9);
  EXPECT_FALSE(temperature_c_in("Input 30 VDC").has_value());
  EXPECT_FALSE(temperature_c_in("").has_value());
}

}  // namespace
}  // namespace rig::drivers::ptu
