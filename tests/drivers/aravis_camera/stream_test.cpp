// Frames over the wire that are wrong in what they say, and chunks. The simulated camera sends these packets
// itself: they were written from the stream protocol (GVSP).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/aravis_camera/support.h"

namespace rig::drivers::aravis {
namespace {

using base::ErrorCode;
using testing::HasSubstr;

using Stream = Gige;

void expect_refused(Rig& rig, sim::wire::GvCameraProcess& camera, const std::string& fault,
                    const std::string& why, ErrorCode code = ErrorCode::damaged) {
  expect_frame(rig, 1e-3);
  ASSERT_TRUE(camera.command(fault));
  const auto frame = rig.take(2e-3);
  ASSERT_FALSE(frame.has_value()) << fault;
  EXPECT_EQ(frame.error().code, code) << fault;
  EXPECT_THAT(frame.error().text(), HasSubstr(why));
  expect_frame(rig, 3e-3);
}

TEST_F(Stream, FramesThatAreNotThoseAskedForAreRefused) {
  auto camera = start_camera({"--own-packets"});
  for (const char* chunks : {"true", "false"}) {
    SCOPED_TRACE(chunks);
    Rig rig(kGige + "chunks = " + chunks + "\n");
    expect_refused(rig, camera, "cut-short", "bytes came of an image of 65536");
    expect_refused(rig, camera, "skip-number", "follows frame");
    expect_refused(rig, camera, "other-format", "pixel format 0x01100006", ErrorCode::device);
    expect_refused(rig, camera, "corrupt", "damaged");
  }
}

// Later than any bound that the driver could wait for: only its time tells that it is another trigger's.
TEST_F(Stream, AFrameOfAnEndedExposureThatComesDuringTheNextIsNotDelivered) {
  auto camera = start_camera({"--own-packets", "--exposes"});
  for (const char* chunks : {"true", "false"}) {
    SCOPED_TRACE(chunks);
    Rig rig(kGige + "chunks = " + chunks + "\n");
    expect_frame(rig, 1e-3);
    int shown = 0;
    for (int i = 0; i < 5 && shown == 0; ++i) {
      ASSERT_TRUE(camera.command("delay 480"));
      ASSERT_TRUE(rig.camera().trigger(0.02, 1).has_value());
      std::this_thread::sleep_for(std::chrono::milliseconds(60));
      ASSERT_TRUE(rig.camera().abort().has_value());
      const auto begun = std::chrono::steady_clock::now();
      ASSERT_TRUE(rig.camera().trigger(0.29, 1).has_value());
      // On a busy machine the old frame comes before the trigger: that shows nothing.
      if (std::chrono::steady_clock::now() - begun < std::chrono::milliseconds(380)) ++shown;
      const auto frame = rig.wait_for_frame();
      ASSERT_TRUE(frame.has_value() && frame->has_value());
      ASSERT_TRUE(rig.painted().has_value());
      EXPECT_EQ(rig.painted()->exposure_us, 290000U);
      expect_frame(rig, 1e-3);
    }
    EXPECT_EQ(shown, 1);
  }
}

// Nothing was delivered since the exposure was ended that it could have been mistaken for.
TEST_F(Stream, AFrameOfAnEndedExposureThatComesBeforeTheNextTriggerIsNoFault) {
  auto camera = start_camera({"--own-packets", "--exposes"});
  Rig rig(kGige);
  expect_frame(rig, 1e-3);
  ASSERT_TRUE(camera.command("delay 500"));
  ASSERT_TRUE(rig.camera().trigger(0.02, 1).has_value());
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  ASSERT_TRUE(rig.camera().abort().has_value());
  std::this_thread::sleep_for(std::chrono::milliseconds(800));
  expect_frame(rig, 2e-3);
  expect_frame(rig, 1e-3);
}

TEST_F(Stream, AChunkThatTellsAnotherExposureIsBelieved) {
  auto camera = start_camera({"--own-packets"});
  Rig rig(kGige);
  expect_refused(rig, camera, "other-exposure", "exposed for 4000 us, set were 2000 us");
}

TEST_F(Stream, WithoutChunksWhatWasSetIsReported) {
  auto camera = start_camera({"--own-packets"});
  Rig rig(kGige + "chunks = false\n");
  ASSERT_TRUE(camera.command("other-exposure"));
  expect_frame(rig, 2e-3);
}

TEST_F(Stream, PacketsThatComeTwiceDoNotHarm) {
  auto camera = start_camera({"--own-packets"});
  Rig rig(kGige + "pixel_format = \"BayerRG12p\"\n");
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(camera.command("packets-twice"));
    expect_frame(rig, 1e-3 * (i + 1));
  }
}

TEST_F(Stream, TheTimeInAChunkIsTheCameras) {
  const auto camera = start_camera({"--own-packets"});
  Rig rig(kGige);
  ASSERT_TRUE(rig.camera().arm().has_value());
  const base::Time before = rig.clock().now();
  expect_frame(rig, 1e-3);
  const auto frame = rig.take(2e-3);
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_GE((*frame)->started, before - std::chrono::milliseconds(50));
  EXPECT_LE((*frame)->started, rig.clock().now());
}

}  // namespace
}  // namespace rig::drivers::aravis
