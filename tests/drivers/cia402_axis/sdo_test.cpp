// SDO transfers, byte by byte as CiA 301 writes them.
#include "drivers/cia402_axis/sdo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/cia402_axis/frames.h"

namespace rig::drivers::cia402 {
namespace {

using base::ErrorCode;
using testing::HasSubstr;
using State = SdoTransfer::State;

constexpr Object kStatus{0x6041, 0}, kName{0x1008, 0}, kTarget{0x607A, 0};

// The rest of a name in segments, from where the client has asked for the first.
struct Segmented {
  SdoTransfer transfer = SdoTransfer::upload(3, kName);
  std::optional<can_frame> asked = transfer.hear(frame_of(0x583, {0x41, 0x08, 0x10, 0x00, 0x0A, 0, 0, 0}));
};

TEST(Sdo, AsksForAnObject) {
  EXPECT_EQ(SdoTransfer::upload(3, kStatus).request(), frame_of(0x603, {0x40, 0x41, 0x60, 0x00, 0, 0, 0, 0}));
}

TEST(Sdo, TakesAnExpeditedAnswerOfEachLength) {
  const struct {
    int command;
    std::string bytes;
  } cases[] = {{0x4F, "\x37"}, {0x4B, "\x37\x02"}, {0x47, "\x37\x02\x11"}, {0x43, "\x37\x02\x11\x22"}};
  for (const auto& one : cases) {
    auto transfer = SdoTransfer::upload(3, kStatus);
    EXPECT_FALSE(transfer.hear(frame_of(0x583, {one.command, 0x41, 0x60, 0x00, 0x37, 0x02, 0x11, 0x22})));
    EXPECT_EQ(transfer.state(), State::done);
    EXPECT_EQ(transfer.bytes(), one.bytes);
  }
  // Without a size: the four are handed on, and the reader takes what it needs.
  auto transfer = SdoTransfer::upload(3, kStatus);
  (void)transfer.hear(frame_of(0x583, {0x42, 0x41, 0x60, 0x00, 0x37, 0x02, 0, 0}));
  EXPECT_EQ(transfer.bytes(), std::string("\x37\x02\0\0", 4));
}

TEST(Sdo, WritesOneTwoThreeAndFourBytes) {
  EXPECT_EQ(SdoTransfer::download(3, {0x6060, 0}, "\x01").request(),
            frame_of(0x603, {0x2F, 0x60, 0x60, 0x00, 0x01, 0, 0, 0}));
  EXPECT_EQ(SdoTransfer::download(3, {0x6040, 0}, std::string_view("\x0F\x00", 2)).request(),
            frame_of(0x603, {0x2B, 0x40, 0x60, 0x00, 0x0F, 0x00, 0, 0}));
  EXPECT_EQ(SdoTransfer::download(3, {0x2000, 1}, "abc").request(),
            frame_of(0x603, {0x27, 0x00, 0x20, 0x01, 'a', 'b', 'c', 0}));
  EXPECT_EQ(SdoTransfer::download(3, kTarget, "\x10\x27\xFF\xFF").request(),
            frame_of(0x603, {0x23, 0x7A, 0x60, 0x00, 0x10, 0x27, 0xFF, 0xFF}));
}

TEST(Sdo, TheAnswerToAWriteEndsIt) {
  auto transfer = SdoTransfer::download(3, kTarget, "\x10\x27\xFF\xFF");
  (void)transfer.hear(frame_of(0x583, {0x60, 0x7A, 0x60, 0x00, 0, 0, 0, 0}));
  EXPECT_EQ(transfer.state(), State::done);
}

TEST(Sdo, PassesOverWhatIsNoAnswerToItsQuestion) {
  const can_frame others[] = {
      frame_of(0x583, {0x4B, 0x64, 0x60, 0x00, 1, 2, 0, 0}),              // another object
      frame_of(0x583, {0x4B, 0x41, 0x60, 0x01, 1, 2, 0, 0}),              // another sub-index
      frame_of(0x584, {0x4B, 0x41, 0x60, 0x00, 1, 2, 0, 0}),              // another node
      frame_of(0x583, {0x60, 0x41, 0x60, 0x00, 0, 0, 0, 0}),              // an answer to a write
      frame_of(0x583, {0x00, 'a', 'b', 'c', 'd', 'e', 'f', 'g'}),         // a segment nobody asked for
      frame_of(0x583, {0x80, 0x64, 0x60, 0x00, 0x00, 0x00, 0x02, 0x06}),  // an abort of another question
      frame_of(0x583, {0x4B, 0x41, 0x60, 0x00, 1, 2}),                    // too short
      frame_of(0x703, {0x05}),
  };
  auto transfer = SdoTransfer::upload(3, kStatus);
  for (const can_frame& other : others) {
    EXPECT_FALSE(transfer.hear(other));
    EXPECT_EQ(transfer.state(), State::waiting);
  }
  auto write = SdoTransfer::download(3, kStatus, "\x0F");
  (void)write.hear(frame_of(0x583, {0x4B, 0x41, 0x60, 0x00, 1, 2, 0, 0}));
  EXPECT_EQ(write.state(), State::waiting);
}

TEST(Sdo, TellsGarbageFromALateAnswer) {
  auto transfer = SdoTransfer::upload(3, kStatus);
  (void)transfer.hear(frame_of(0x583, {0x4B, 0x64, 0x60, 0x00, 1, 2, 0, 0}));
  EXPECT_FALSE(transfer.saw_garbage());
  (void)transfer.hear(frame_of(0x583, {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}));
  EXPECT_TRUE(transfer.saw_garbage());
  EXPECT_EQ(transfer.state(), State::waiting);
}

TEST(Sdo, ReadsANameInSegments) {
  Segmented name;
  ASSERT_TRUE(name.asked);
  EXPECT_EQ(*name.asked, frame_of(0x603, {0x60, 0, 0, 0, 0, 0, 0, 0}));
  const auto second = name.transfer.hear(frame_of(0x583, {0x00, 'd', 'r', 'i', 'v', 'e', ' ', 'n'}));
  ASSERT_TRUE(second);
  EXPECT_EQ(*second, frame_of(0x603, {0x70, 0, 0, 0, 0, 0, 0, 0}));
  // Toggled, four of its seven bytes empty, the last.
  EXPECT_FALSE(name.transfer.hear(frame_of(0x583, {0x19, 'o', '1', '2', 0, 0, 0, 0})));
  EXPECT_EQ(name.transfer.state(), State::done);
  EXPECT_EQ(name.transfer.bytes(), "drive no12");
}

TEST(Sdo, AWrongToggleBitAbortsTheTransfer) {
  Segmented name;
  const auto sent = name.transfer.hear(frame_of(0x583, {0x10, 'd', 'r', 'i', 'v', 'e', ' ', 'n'}));
  ASSERT_TRUE(sent);
  EXPECT_EQ(*sent, frame_of(0x603, {0x80, 0x08, 0x10, 0x00, 0x00, 0x00, 0x03, 0x05}));
  EXPECT_EQ(name.transfer.state(), State::failed);
  EXPECT_EQ(name.transfer.error().code, ErrorCode::damaged);
  EXPECT_THAT(name.transfer.error().what, HasSubstr("toggle"));
}

TEST(Sdo, ASegmentThatComesTwiceIsAWrongToggleBit) {
  Segmented name;
  const can_frame first = frame_of(0x583, {0x00, 'd', 'r', 'i', 'v', 'e', ' ', 'n'});
  (void)name.transfer.hear(first);
  (void)name.transfer.hear(first);
  EXPECT_EQ(name.transfer.state(), State::failed);
}

TEST(Sdo, MoreOrFewerBytesThanAnnouncedAreDamaged) {
  Segmented fewer;
  (void)fewer.transfer.hear(frame_of(0x583, {0x01, 'd', 'r', 'i', 'v', 'e', ' ', 'n'}));
  EXPECT_EQ(fewer.transfer.state(), State::failed);
  EXPECT_EQ(fewer.transfer.error().code, ErrorCode::damaged);
  Segmented more;
  (void)more.transfer.hear(frame_of(0x583, {0x00, 'd', 'r', 'i', 'v', 'e', ' ', 'n'}));
  (void)more.transfer.hear(frame_of(0x583, {0x10, 'o', '1', '2', '3', '4', '5', '6'}));
  EXPECT_EQ(more.transfer.state(), State::failed);
  auto huge = SdoTransfer::upload(3, kName);
  (void)huge.hear(frame_of(0x583, {0x41, 0x08, 0x10, 0x00, 0xFF, 0xFF, 0xFF, 0x7F}));
  EXPECT_EQ(huge.state(), State::failed);
}

TEST(Sdo, SegmentsWithoutAnAnnouncedLengthEnd) {
  auto transfer = SdoTransfer::upload(3, kName);
  EXPECT_TRUE(transfer.hear(frame_of(0x583, {0x40, 0x08, 0x10, 0x00, 0, 0, 0, 0})));
  (void)transfer.hear(frame_of(0x583, {0x0D, 'a', 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(transfer.state(), State::done);
  EXPECT_EQ(transfer.bytes(), "a");
}

TEST(Sdo, AnAbortIsToldInWords) {
  const struct {
    std::uint32_t code;
    ErrorCode kind;
    const char* text;
  } cases[] = {
      {0x06020000, ErrorCode::not_found, "does not exist"},   {0x06090011, ErrorCode::not_found, "sub-index"},
      {0x06090030, ErrorCode::device, "out of range"},        {0x06010002, ErrorCode::device, "only be read"},
      {0x08000022, ErrorCode::device, "state of the device"}, {0x05040001, ErrorCode::damaged, "not valid"},
      {0x12345678, ErrorCode::device, "0x12345678"},
  };
  for (const auto& one : cases) {
    auto transfer = SdoTransfer::upload(3, {0x6099, 1});
    const auto byte = [&](int i) { return static_cast<int>(one.code >> (8 * i) & 0xFF); };
    (void)transfer.hear(frame_of(0x583, {0x80, 0x99, 0x60, 0x01, byte(0), byte(1), byte(2), byte(3)}));
    ASSERT_EQ(transfer.state(), State::failed);
    EXPECT_EQ(transfer.aborted_with(), one.code);
    EXPECT_EQ(transfer.error().code, one.kind) << one.text;
    EXPECT_THAT(transfer.error().what, HasSubstr("6099:1"));
    EXPECT_THAT(transfer.error().what, HasSubstr(one.text));
  }
}

TEST(Sdo, NothingIsTakenOnceItIsOver) {
  auto transfer = SdoTransfer::upload(3, kStatus);
  (void)transfer.hear(frame_of(0x583, {0x4B, 0x41, 0x60, 0x00, 0x37, 0x02, 0, 0}));
  (void)transfer.hear(frame_of(0x583, {0x4B, 0x41, 0x60, 0x00, 0x11, 0x11, 0, 0}));
  EXPECT_EQ(transfer.bytes(), "\x37\x02");
}

TEST(Sdo, AbortsInTheNameOfItsObject) {
  EXPECT_EQ(SdoTransfer::upload(3, kStatus).abort(abort_code::kTimedOut),
            frame_of(0x603, {0x80, 0x41, 0x60, 0x00, 0x00, 0x00, 0x04, 0x05}));
}

}  // namespace
}  // namespace rig::drivers::cia402
