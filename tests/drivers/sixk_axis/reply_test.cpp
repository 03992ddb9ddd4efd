// Against the forms that answers take at error levels 4 and 1.
#include "drivers/sixk_axis/reply.h"

#include <gtest/gtest.h>
#include <vector>

namespace rig::drivers::sixk {
namespace {

using Kind = Reply::Kind;

std::vector<Reply> read(const std::string& bytes) {
  ReplyReader reader;
  reader.feed(bytes);
  std::vector<Reply> replies;
  while (auto reply = reader.next()) replies.push_back(*reply);
  return replies;
}

const Reply kFine{Kind::fine, {}};
const Reply kBad{Kind::bad, {}};

Reply answer(std::string text) {
  return {Kind::answer, std::move(text)};
}

TEST(SixkReply, AnswersAndPrompts) {
  EXPECT_EQ(read("*1TPM+1000\r\r\n> "), (std::vector{answer("1TPM+1000"), kFine}));
  EXPECT_EQ(read("*1TPM+1000\r\n\r\n> "), (std::vector{answer("1TPM+1000"), kFine}));
  EXPECT_EQ(read("\r\n> "), (std::vector{kFine}));
  EXPECT_EQ(read("\r\n>"), (std::vector{kFine}));
  EXPECT_EQ(read("\r\n*UNDEFINED LABEL\r\r\n? "), (std::vector{answer("UNDEFINED LABEL"), kBad}));
  EXPECT_EQ(read("*+1000\r\n"), (std::vector{answer("+1000")}));
  EXPECT_EQ(read("\r\n- "), (std::vector{Reply{Kind::defining, {}}}));
}

TEST(SixkReply, EchoesAreLines) {
  EXPECT_EQ(read("!1TPM\r\n*1TPM+5\r\n\r\n> "),
            (std::vector{Reply{Kind::line, "!1TPM"}, answer("1TPM+5"), kFine}));
  // Behind the prompt of the command before.
  EXPECT_EQ(read("\r\n> !1S\r\n\r\n> "), (std::vector{kFine, Reply{Kind::line, "!1S"}, kFine}));
}

TEST(SixkReply, BehindNoiseAnAnswerIsWhole) {
  EXPECT_EQ(read("x*y*1TPM+5\r\n"), (std::vector{answer("1TPM+5")}));
  EXPECT_EQ(read("abc\r\n"), (std::vector{Reply{Kind::line, "abc"}}));
}

TEST(SixkReply, ALineWithoutAnEndDoesNotGrowForEver) {
  ReplyReader reader;
  int lines = 0;
  for (int i = 0; i < 100; ++i) {
    reader.feed(std::string(100, 'x'));
    while (auto reply = reader.next()) {
      EXPECT_EQ(reply->kind, Kind::line);
      EXPECT_LE(reply->text.size(), 256U);
      ++lines;
    }
  }
  EXPECT_EQ(lines, 10000 / 256);
}

TEST(SixkReply, HowTheBytesAreCutMakesNoDifference) {
  const std::string bytes = "!1TAS\r\n*1TAS1000_0000\r\n\r\n> \r\n*BAD\r\r\n? junk\r\n- *+5\r\n";
  const auto whole = read(bytes);
  EXPECT_GT(whole.size(), 5U);
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

TEST(SixkValue, BelongsToItsQuery) {
  EXPECT_EQ(value_in("1TPM+1000", 1, "TPM", false), "+1000");
  EXPECT_EQ(value_in("1tpm+1000", 1, "TPM", false), "+1000");
  EXPECT_EQ(value_in("3_1TPM-5", 1, "TPM", false), "-5");
  EXPECT_EQ(value_in("3_!1TPM-5", 1, "TPM", false), "-5");
  EXPECT_EQ(value_in("TREV92-016740-01-5.1.0 6K", 0, "TREV", false), "92-016740-01-5.1.0 6K");
  EXPECT_EQ(value_in("1A10.0000", 1, "A", false), "10.0000");
  // Another axis, another query, a longer name, a message.
  EXPECT_FALSE(value_in("2TPM+1000", 1, "TPM", false).has_value());
  EXPECT_FALSE(value_in("TPM+1000", 1, "TPM", false).has_value());
  EXPECT_FALSE(value_in("1TPE+1000", 1, "TPM", false).has_value());
  EXPECT_FALSE(value_in("1AD10.0000", 1, "A", false).has_value());
  EXPECT_FALSE(value_in("DRIVE SHUTDOWN", 1, "TPM", true).has_value());
  EXPECT_FALSE(value_in("x1TPM+5", 1, "TPM", false).has_value());
}

TEST(SixkValue, ANamelessOneCountsOnlyWhereNoneHaveNames) {
  EXPECT_EQ(value_in("+1000", 1, "TPM", true), "+1000");
  EXPECT_FALSE(value_in("+1000", 1, "TPM", false).has_value());
  EXPECT_EQ(value_in("0000_1000", 1, "TAS", true), "0000_1000");
}

TEST(SixkNumber, IsTheWholeText) {
  EXPECT_EQ(number_in("+1000"), 1000);
  EXPECT_EQ(number_in("-12.5"), -12.5);
  EXPECT_EQ(number_in("25000"), 25000);
  for (const char* text : {"", "+", "1000x", "1 000", "0x10", "inf", "nan", "1e5", "--5"}) {
    EXPECT_FALSE(number_in(text).has_value()) << text;
  }
}

std::string with_bits(std::initializer_list<std::size_t> bits) {
  std::string text;
  for (std::size_t bit = 1; bit <= 32; ++bit) {
    if (bit > 1 && bit % 4 == 1) text += '_';
    const bool set = std::find(bits.begin(), bits.end(), bit) != bits.end();
    text += set ? '1' : '0';
  }
  return text;
}

TEST(SixkStatus, CountsItsBitsFromOne) {
  const auto at_rest = status_in("0000_1100_0000_0000_0000_0000_0000_0000");
  ASSERT_TRUE(at_rest.has_value());
  EXPECT_TRUE(at_rest->homed);
  EXPECT_TRUE(at_rest->absolute);
  EXPECT_FALSE(at_rest->moving);
  EXPECT_EQ(fault_of(*at_rest), "");
  EXPECT_TRUE(status_in(with_bits({1}))->moving);
  EXPECT_TRUE(status_in(with_bits({12}))->stalled);
  EXPECT_TRUE(status_in(with_bits({13}))->shut_down);
  EXPECT_TRUE(status_in(with_bits({14}))->drive_fault);
  for (const std::size_t bit : {15U, 17U}) {
    EXPECT_TRUE(status_in(with_bits({bit}))->positive_limit);
    EXPECT_FALSE(status_in(with_bits({bit}))->negative_limit);
  }
  for (const std::size_t bit : {16U, 18U}) {
    EXPECT_TRUE(status_in(with_bits({bit}))->negative_limit);
    EXPECT_FALSE(status_in(with_bits({bit}))->positive_limit);
  }
  EXPECT_TRUE(status_in(with_bits({23}))->strayed);
  EXPECT_TRUE(status_in(with_bits({25}))->missed_zone);
}

TEST(SixkStatus, IsReadWithoutItsUnderscores) {
  std::string plain = with_bits({1, 5});
  std::erase(plain, '_');
  const auto status = status_in(plain);
  ASSERT_TRUE(status.has_value());
  EXPECT_TRUE(status->moving && status->homed);
}

TEST(SixkStatus, AnythingElseIsNone) {
  const std::string good = with_bits({1});
  for (const std::string& text : {std::string(), good.substr(1), good + "0", good + "_", "_" + good,
                                  good.substr(0, good.size() - 1) + "2", "1000__0000" + good.substr(9),
                                  std::string("0") + good.substr(2)}) {
    EXPECT_FALSE(status_in(text).has_value()) << text;
  }
}

TEST(SixkStatus, FaultsInWords) {
  EXPECT_EQ(fault_of(*status_in(with_bits({14}))), "drive fault");
  EXPECT_EQ(
      fault_of(*status_in(with_bits({12, 23, 25}))),
      "the motor has stalled, its position error is too large, it did not reach its target zone in time");
  EXPECT_EQ(fault_of(*status_in(with_bits({1, 5, 13, 15}))), "");
}

}  // namespace
}  // namespace rig::drivers::sixk
