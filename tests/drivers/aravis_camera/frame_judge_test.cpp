// What is a frame, what is an old one, and what is none.
#include "drivers/aravis_camera/frame_judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rig::drivers::aravis {
namespace {

using testing::HasSubstr;

Expected expected() {
  Expected e;
  e.format = 0x01100007;
  e.width = 4;
  e.height = 2;
  e.offset_x = 8;
  e.image_bytes = 16;
  e.payload_bytes = 16;
  e.exposure_s = 1e-3;
  e.last_id = 6;
  return e;
}

BufferFacts facts() {
  BufferFacts f;
  f.frame_id = 7;
  f.format = 0x01100007;
  f.width = 4;
  f.height = 2;
  f.offset_x = 8;
  f.bytes = 16;
  f.taken_ns = 1000;
  return f;
}

void expect_bad(const Expected& e, const BufferFacts& f, const std::string& why) {
  const Judgement judgement = judge(e, f);
  EXPECT_EQ(judgement.verdict, Verdict::bad);
  EXPECT_THAT(judgement.why, HasSubstr(why));
}

// Of this frame only: the next may be good.
void expect_spoilt(const Expected& e, const BufferFacts& f, const std::string& why) {
  const Judgement judgement = judge(e, f);
  EXPECT_EQ(judgement.verdict, Verdict::spoilt);
  EXPECT_THAT(judgement.why, HasSubstr(why));
}

TEST(FrameJudge, WhatWasAskedForIsGood) {
  EXPECT_EQ(judge(expected(), facts()).verdict, Verdict::good);
}

TEST(FrameJudge, DamageIsDamageWhateverElseItSays) {
  auto f = facts();
  f.damage = "packets are missing";
  expect_spoilt(expected(), f, "packets are missing");
}

TEST(FrameJudge, AnotherImageIsBad) {
  auto f = facts();
  f.is_image = false;
  expect_bad(expected(), f, "no image");
  f = facts();
  f.format = 0x01080001;
  expect_bad(expected(), f, "pixel format");
  f = facts();
  f.width = 5;
  expect_bad(expected(), f, "5 x 2");
  f = facts();
  f.offset_x = 0;
  expect_bad(expected(), f, "(0, 0)");
  f = facts();
  f.line_padding = 2;
  expect_bad(expected(), f, "between its lines");
}

TEST(FrameJudge, EveryByteHasToCome) {
  auto f = facts();
  f.bytes = 15;
  expect_spoilt(expected(), f, "15 bytes");
  f.bytes = 17;
  expect_spoilt(expected(), f, "17 bytes");
  auto e = expected();
  e.payload_bytes = 48;
  EXPECT_EQ(judge(e, f).verdict, Verdict::good) << "the camera appends chunks";
}

TEST(FrameJudge, NumbersHaveNoGaps) {
  auto f = facts();
  for (const std::uint64_t id : {5, 6, 8}) {
    f.frame_id = id;
    expect_spoilt(expected(), f, "follows frame 6");
  }
  auto e = expected();
  e.last_id.reset();
  EXPECT_EQ(judge(e, f).verdict, Verdict::good) << "the first of a stream may have any number";
  EXPECT_TRUE(follows(65535, 1)) << "GigE Vision's numbers have 16 bits, and 0 is none";
  EXPECT_TRUE(follows(65535, 65536)) << "extended ones have 64";
  EXPECT_FALSE(follows(65535, 2));
}

TEST(FrameJudge, AnotherExposureIsNoGood) {
  auto f = facts();
  f.exposure_s = 2e-3;
  expect_spoilt(expected(), f, "exposed for 2000 us, set were 1000 us");
  f.exposure_s = 1.01e-3;
  EXPECT_EQ(judge(expected(), f).verdict, Verdict::good) << "a camera rounds to its lines";
  auto e = expected();
  e.exposure_s = 10e-6;
  f.exposure_s = 20e-6;
  expect_spoilt(e, f, "exposed for 20 us");
}

TEST(FrameJudge, OfACameraThatRunsFreeOldOnesAreTold) {
  auto e = expected();
  e.last_id.reset();
  e.not_before_ns = 1001;
  EXPECT_EQ(judge(e, facts()).verdict, Verdict::old);
  e.not_before_ns = 1000;
  EXPECT_EQ(judge(e, facts()).verdict, Verdict::good);
}

TEST(FrameJudge, AFrameThatBeganBeforeItsTriggerIsOld) {
  auto e = expected();
  e.clock_error_s = 0.05;
  e.last_id.reset();
  auto f = facts();
  f.before_trigger_s = 0.06;
  EXPECT_EQ(judge(e, f).verdict, Verdict::old);
  f.before_trigger_s = 0.04;
  EXPECT_EQ(judge(e, f).verdict, Verdict::good);
  f.before_trigger_s = -1;
  EXPECT_EQ(judge(e, f).verdict, Verdict::good);
  // By another clock than the one that is latched.
  f.before_trigger_s = 1e6;
  EXPECT_EQ(judge(e, f).verdict, Verdict::good);
  f.before_trigger_s.reset();
  EXPECT_EQ(judge(e, f).verdict, Verdict::good);
}

}  // namespace
}  // namespace rig::drivers::aravis
