// Packets that are lost on their way and asked for again. The simulated camera keeps its packets and answers
// as the control protocol (GVCP) has it; who asks is Aravis.
#include <algorithm>
#include <gtest/gtest.h>
#include <numeric>

#include "tests/drivers/aravis_camera/support.h"

namespace rig::drivers::aravis {
namespace {

using base::ErrorCode;

using Resend = Gige;

constexpr unsigned kFrames = 40;
// Two packets in a hundred, of 27 a frame: four frames in ten lack one. The same ones for each camera.
const std::vector<std::string> kLossy{"--own-packets", "--resend", "--lost", "20"};
const std::string kSmall = kGige + "pixel_format = \"Mono8\"\n";

// Which frames came. Those that did are as they were painted; the others are damaged.
std::vector<bool> frames_that_came(Rig& rig) {
  std::vector<bool> came;
  for (unsigned i = 0; i < kFrames; ++i) {
    const double exposure_s = 1e-3 * (i % 5 + 1);
    const auto frame = rig.take(exposure_s);
    came.push_back(frame.has_value());
    if (!frame) {
      EXPECT_EQ(frame.error().code, ErrorCode::damaged) << frame.error().text();
      continue;
    }
    EXPECT_TRUE(frame->has_value()) << "neither a frame nor an error";
    const auto painted = rig.painted();
    EXPECT_TRUE(painted.has_value()) << "a damaged frame was delivered as good";
    EXPECT_EQ(painted.value_or(sim::wire::PatternFacts{}).exposure_us, 1000 * (i % 5 + 1));
  }
  return came;
}

// What the driver told of Aravis' count.
unsigned packets_told(const test::Said& said) {
  const auto lines = said.with("asked for again");
  return std::accumulate(lines.begin(), lines.end(), 0U, [](unsigned sum, const std::string& line) {
    return sum + static_cast<unsigned>(std::stoul(line.substr(line.find(": ") + 2)));
  });
}

TEST_F(Resend, FramesThatWouldBeDamagedComeWhole) {
  unsigned damaged = 0;
  {
    const auto camera = start_camera(kLossy);
    Rig rig(kSmall + "packet_resend = false\n");
    const auto came = frames_that_came(rig);
    damaged = static_cast<unsigned>(std::count(came.begin(), came.end(), false));
    EXPECT_GT(damaged, kFrames / 8);
    EXPECT_LT(damaged, kFrames);
    rig.close();
    EXPECT_EQ(packets_told(rig.said()), 0U);
  }
  const auto camera = start_camera(kLossy);
  Rig rig(kSmall + "frame_retention_ms = 1000\n");
  EXPECT_EQ(frames_that_came(rig), std::vector<bool>(kFrames, true));
  rig.close();
  EXPECT_GE(packets_told(rig.said()), damaged);
}

TEST_F(Resend, WhatWasMendedIsToldWithTheNextBracket) {
  const auto camera = start_camera(kLossy);
  Rig rig(kSmall + "frame_retention_ms = 1000\n");
  (void)frames_that_came(rig);
  EXPECT_EQ(packets_told(rig.said()), 0U);
  ASSERT_TRUE(rig.camera().arm().has_value());
  const unsigned told = packets_told(rig.said());
  EXPECT_GT(told, 0U);
  ASSERT_TRUE(rig.camera().arm().has_value());
  EXPECT_EQ(packets_told(rig.said()), told) << "once";
}

}  // namespace
}  // namespace rig::drivers::aravis
