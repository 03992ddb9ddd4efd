// Which of the frames of a camera that runs free is the one that was asked for.
#include "drivers/v4l2_camera/frame_sieve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rig::drivers::v4l2 {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::size_t kBytes = 100;
constexpr double kInterval_s = 10e-3;

FrameFacts frame(std::uint32_t sequence, std::int64_t stamp_ms) {
  FrameFacts facts;
  facts.bytes = kBytes;
  facts.sequence = sequence;
  facts.stamp_ns = stamp_ms * kMs;
  return facts;
}

FrameSieve sieve_after(std::int64_t set_ms, double exposure_s, int settle) {
  FrameSieve sieve(kBytes, kInterval_s);
  sieve.set(set_ms * kMs, exposure_s, settle);
  sieve.trigger(set_ms * kMs);
  return sieve;
}

TEST(FrameSieve, AFrameThatMayHaveBegunBeforeTheSettingIsOld) {
  FrameSieve sieve = sieve_after(1000, 4e-3, 0);
  // Of the end of a frame: an exposure and a readout earlier it may have begun.
  EXPECT_EQ(sieve.look(frame(1, 1013)).verdict, Verdict::old);
  EXPECT_EQ(sieve.look(frame(2, 1015)).verdict, Verdict::good);
}

TEST(FrameSieve, AStampOfTheStartMayBeOfTheEndOfTheExposure) {
  FrameSieve sieve = sieve_after(1000, 4e-3, 0);
  auto facts = frame(1, 1003);
  facts.stamp_is_start = true;
  EXPECT_EQ(sieve.look(facts).verdict, Verdict::old);
  facts = frame(2, 1013);
  facts.stamp_is_start = true;
  EXPECT_EQ(sieve.look(facts).verdict, Verdict::good);
}

TEST(FrameSieve, TheExposureBeforeMayBeTheLongerOne) {
  FrameSieve sieve = sieve_after(0, 50e-3, 0);
  sieve.set(1000 * kMs, 1e-3, 1);
  EXPECT_EQ(sieve.look(frame(1, 1059)).verdict, Verdict::old) << "50 ms and a readout before, it was not set";
  EXPECT_EQ(sieve.look(frame(2, 1061)).verdict, Verdict::settling);
  sieve.trigger(1070 * kMs);
  EXPECT_EQ(sieve.look(frame(3, 1080)).verdict, Verdict::old);
  EXPECT_EQ(sieve.look(frame(4, 1082)).verdict, Verdict::good) << "now all frames are short";
}

TEST(FrameSieve, SettlingGoesOnOverAnExposureThatWasEnded) {
  FrameSieve sieve = sieve_after(1000, 1e-3, 3);
  EXPECT_EQ(sieve.look(frame(1, 1020)).verdict, Verdict::settling);
  sieve.trigger(1021 * kMs);
  EXPECT_EQ(sieve.look(frame(2, 1030)).verdict, Verdict::settling);
  EXPECT_EQ(sieve.look(frame(3, 1040)).verdict, Verdict::settling);
  EXPECT_EQ(sieve.look(frame(4, 1050)).verdict, Verdict::good);
}

TEST(FrameSieve, WhatIsDamagedDoesNotSettle) {
  FrameSieve sieve = sieve_after(1000, 1e-3, 1);
  auto facts = frame(1, 1020);
  facts.damaged = true;
  EXPECT_EQ(sieve.look(facts).verdict, Verdict::damaged);
  facts = frame(2, 1030);
  facts.bytes = kBytes - 1;
  EXPECT_EQ(sieve.look(facts).verdict, Verdict::damaged);
  EXPECT_EQ(sieve.look(frame(3, 1040)).verdict, Verdict::settling);
  EXPECT_EQ(sieve.look(frame(4, 1050)).verdict, Verdict::good);
}

TEST(FrameSieve, GapsAreCounted) {
  FrameSieve sieve = sieve_after(1000, 1e-3, 0);
  EXPECT_EQ(sieve.look(frame(0xFFFFFFFE, 1020)).lost, 0U) << "the first may have any number";
  EXPECT_EQ(sieve.look(frame(0xFFFFFFFF, 1030)).lost, 0U);
  EXPECT_EQ(sieve.look(frame(2, 1061)).lost, 2U) << "numbers go round";
  EXPECT_EQ(sieve.look(frame(0, 1070)).lost, 0U) << "a stream that began anew is no gap";
}

TEST(FrameSieve, FramesAreNotQuickerThanTheirExposure) {
  FrameSieve sieve = sieve_after(1000, 100e-3, 0);
  std::int64_t at_ms = 1200;
  std::uint32_t number = 1;
  EXPECT_EQ(sieve.look(frame(number++, at_ms)).verdict, Verdict::good) << "nothing to compare with";
  // One stamp that was late is no proof.
  EXPECT_EQ(sieve.look(frame(number++, at_ms += 60)).verdict, Verdict::too_quick);
  EXPECT_EQ(sieve.look(frame(number++, at_ms += 140)).verdict, Verdict::good);
  EXPECT_EQ(sieve.look(frame(number++, at_ms += 94)).verdict, Verdict::good) << "within what stamps are late";
  EXPECT_EQ(sieve.look(frame(number += 2, at_ms += 30)).verdict, Verdict::good)
      << "the one before is missing";
  ++number;
  for (int i = 0; i < 4; ++i) EXPECT_EQ(sieve.look(frame(number++, at_ms += 10)).verdict, Verdict::too_quick);
  const Judgement judgement = sieve.look(frame(number, at_ms + 10));
  EXPECT_EQ(judgement.verdict, Verdict::bad);
  EXPECT_THAT(judgement.why, HasSubstr("after 10.0 ms"));
}

TEST(FrameSieve, WithoutAClockNothingIsKnown) {
  FrameSieve sieve = sieve_after(1000, 1e-3, 0);
  auto facts = frame(1, 1020);
  facts.monotonic = false;
  const Judgement judgement = sieve.look(facts);
  EXPECT_EQ(judgement.verdict, Verdict::bad);
  EXPECT_FALSE(judgement.why.empty());
}

}  // namespace
}  // namespace rig::drivers::v4l2
