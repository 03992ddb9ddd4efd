// The driver on Aravis' simulated GigE Vision camera, in another process, over UDP. Every frame carries in
// its pixels how it was taken.
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "tests/drivers/aravis_camera/support.h"

namespace rig::drivers::aravis {
namespace {

using base::ErrorCode;
using std::chrono::milliseconds;
using testing::HasSubstr;

TEST_F(Gige, EveryFormatComesAsItWasPainted) {
  const auto camera = start_camera();
  for (const char* name : {"Mono8", "Mono10", "Mono10Packed", "Mono10p", "Mono12", "Mono12Packed", "Mono12p",
                           "Mono16", "BayerRG8", "BayerGR10", "BayerRG10p", "BayerRG10Packed", "BayerGB12",
                           "BayerBG12p", "BayerRG12Packed", "BayerBG16"}) {
    Rig rig(kGige + "pixel_format = \"" + name + "\"");
    SCOPED_TRACE(name);
    EXPECT_EQ(rig.capabilities().bits, find_pixel_format(name)->bits);
    EXPECT_EQ(rig.capabilities().bayer, find_pixel_format(name)->bayer);
    expect_frame(rig, 1.5e-3);
  }
}

TEST_F(Gige, ExposuresInTurnAreThoseOfTheirFrames) {
  const auto camera = start_camera();
  Rig rig(kGige);
  ASSERT_TRUE(rig.camera().arm().has_value());
  std::optional<std::uint32_t> last;
  for (int i = 0; i < 40; ++i) {
    expect_frame(rig, i % 2 == 0 ? 1e-3 : 7e-3);
    const auto frame = rig.painted()->frame;
    if (last) {
      EXPECT_EQ(frame, *last + 1) << "the camera took more frames than it was triggered";
    }
    last = frame;
  }
}

TEST_F(Gige, GainIsSetInTheCamerasUnit) {
  const auto camera = start_camera();
  Rig rig(kGige + "gain_unit = \"factor\"\ngain_counts = 2\n");
  const auto frame = rig.take(1e-3, 3);
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_EQ(rig.painted()->gain, 6U);
  EXPECT_DOUBLE_EQ((*frame)->gain, 3);
  const auto too_much = rig.camera().trigger(1e-3, 6);
  ASSERT_FALSE(too_much.has_value());
  EXPECT_EQ(too_much.error().code, ErrorCode::bad_input);
  EXPECT_THAT(too_much.error().text(), HasSubstr("takes 0 to 10"));
}

TEST_F(Gige, InDecibelGainOneIsNone) {
  const auto camera = start_camera();
  Rig rig(kGige);
  ASSERT_TRUE(rig.take(1e-3, 1).has_value());
  EXPECT_EQ(rig.painted()->gain, 0U);
  const auto frame = rig.take(1e-3, 2);  // 6.02 dB, of a feature in whole dB
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_EQ(rig.painted()->gain, 6U);
  EXPECT_NEAR((*frame)->gain, 1.995, 0.001);
  for (const double none : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(rig.camera().trigger(1e-3, none).has_value());
  }
}

TEST_F(Gige, AnExposureOutOfItsRangeIsRefusedWithTheRange) {
  const auto camera = start_camera();
  Rig rig(kGige);
  EXPECT_DOUBLE_EQ(rig.capabilities().min_exposure_s, 10e-6);
  EXPECT_DOUBLE_EQ(rig.capabilities().max_exposure_s, 10);
  for (const double exposure_s : {9e-6, 11.0, std::numeric_limits<double>::quiet_NaN()}) {
    const auto refused = rig.camera().trigger(exposure_s, 1);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
    EXPECT_THAT(refused.error().text(), HasSubstr("only for 10 to 10000000 us"));
  }
  expect_frame(rig, 10e-6);
}

TEST_F(Gige, TheRegionIsTheOneAskedFor) {
  const auto camera = start_camera();
  Rig part("address = \"127.0.0.1\"\nwidth = 128\nheight = 64\noffset_x = 16\noffset_y = 32");
  EXPECT_EQ(part.capabilities().width, 128);
  EXPECT_EQ(part.capabilities().height, 64);
  expect_frame(part, 1e-3);
  part.close();
  Rig rest("address = \"127.0.0.1\"\npacket_size = 60000\npixel_format = \"Mono8\"\noffset_x = 2000");
  EXPECT_EQ(rest.capabilities().width, 48);
  EXPECT_EQ(rest.capabilities().height, 2048);
  expect_frame(rest, 1e-3);
}

TEST_F(Gige, DamagedFramesAreRefusedAndTheNextIsWhole) {
  auto camera = start_camera();
  Rig rig(kGige);
  for (int i = 0; i < 5; ++i) {
    expect_frame(rig, 1e-3);
    ASSERT_TRUE(camera.command("corrupt"));
    const auto frame = rig.take(2e-3);
    ASSERT_FALSE(frame.has_value());
    EXPECT_EQ(frame.error().code, ErrorCode::damaged);
    EXPECT_THAT(frame.error().text(), HasSubstr("damaged"));
  }
  expect_frame(rig, 3e-3);
}

TEST_F(Gige, AMissingFrameNeverComesAndTheNextIsItsOwn) {
  auto camera = start_camera();
  Rig rig(kGige);
  expect_frame(rig, 1e-3);
  ASSERT_TRUE(camera.command("drop"));
  ASSERT_TRUE(rig.camera().trigger(2e-3, 1).has_value());
  const auto frame = rig.wait_for_frame(milliseconds(700));
  ASSERT_TRUE(frame.has_value()) << frame.error().text();
  EXPECT_FALSE(frame->has_value());
  ASSERT_TRUE(rig.camera().abort().has_value());
  expect_frame(rig, 3e-3);
}

// Under a loss of one packet in fifty, with and without asking for packets again.
TEST_F(Gige, WithPacketsLostEveryFrameIsWholeOrRefused) {
  auto camera = start_camera({"--lost", "20"});
  for (const char* resend : {"true", "false"}) {
    Rig rig(kGige + "pixel_format = \"Mono8\"\npacket_resend = " + resend + "\nframe_retention_ms = 20\n");
    int whole = 0, refused = 0;
    for (int i = 0; i < 60; ++i) {
      const double exposure_s = 1e-3 * (i % 5 + 1);
      ASSERT_TRUE(rig.camera().trigger(exposure_s, 1).has_value());
      const auto frame = rig.wait_for_frame(milliseconds(300));
      if (frame.has_value() && frame->has_value()) {
        const auto painted = rig.painted();
        ASSERT_TRUE(painted.has_value()) << "a damaged frame was delivered as good";
        EXPECT_NEAR(painted->exposure_us * 1e-6, exposure_s, 1e-6);
        ++whole;
      } else {
        ++refused;
        ASSERT_TRUE(rig.camera().abort().has_value());
      }
    }
    EXPECT_GT(whole, 0);
    EXPECT_GT(refused, 0);
  }
}

// The camera is still exposing when the exposure is ended; its frame comes all the same.
TEST_F(Gige, AnAbortedExposureIsNeverDelivered) {
  const auto camera = start_camera({"--exposes"});
  Rig rig(
      "address = \"127.0.0.1\"\npacket_size = 1400\nwidth = 256\nheight = 128\nreadout_ms = 300\nanswer_ms = "
      "2000");
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(rig.camera().trigger(0.2, 1).has_value());
    ASSERT_TRUE(rig.camera().abort().has_value());
    expect_frame(rig, 2e-3);
    ASSERT_TRUE(rig.camera().trigger(0.1, 1).has_value());
    ASSERT_TRUE(rig.camera().arm().has_value());
    expect_frame(rig, 3e-3);
  }
  // Not even by waiting for it: that would be long.
  ASSERT_TRUE(rig.camera().trigger(5, 1).has_value());
  ASSERT_TRUE(rig.camera().abort().has_value());
  const auto refused = rig.camera().trigger(1e-3, 1);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::busy);
  EXPECT_THAT(refused.error().text(), HasSubstr("goes on in it"));
}

TEST_F(Gige, OneExposureAtATime) {
  const auto camera = start_camera({"--exposes"});
  Rig rig(kGige);
  EXPECT_EQ(rig.camera().fetch(rig.pixels()).error().code, ErrorCode::device) << "nothing was triggered";
  ASSERT_TRUE(rig.camera().trigger(0.05, 1).has_value());
  EXPECT_EQ(rig.camera().trigger(0.05, 1).error().code, ErrorCode::busy);
  const auto frame = rig.wait_for_frame();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_FALSE(rig.camera().fetch(rig.pixels()).has_value()) << "a frame is delivered once";
}

TEST_F(Gige, TimeOfAFrameIsTheCamerasByOurClock) {
  const auto camera = start_camera();
  Rig rig(kGige);
  ASSERT_TRUE(rig.camera().arm().has_value());
  const base::Time before = rig.clock().now();
  const auto frame = rig.take(1e-3);
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  // A latch is half a round trip off, and what is further off than this the driver does not believe.
  EXPECT_GE((*frame)->started, before - milliseconds(50));
  EXPECT_LE((*frame)->started, rig.clock().now());
}

TEST_F(Gige, ThePulseOfALineBeginsTheExposure) {
  auto camera = start_camera();
  Rig rig(kGige + "trigger_line = \"Line0\"\n");
  for (int i = 0; i < 5; ++i) {
    const double exposure_s = 1e-3 * (i + 1);
    ASSERT_TRUE(rig.camera().await_trigger(exposure_s, 1).has_value());
    const auto nothing = rig.wait_for_frame(milliseconds(20));
    ASSERT_TRUE(nothing.has_value());
    EXPECT_FALSE(nothing->has_value()) << "a frame without a pulse";
    ASSERT_TRUE(camera.command("pulse"));
    const auto frame = rig.wait_for_frame();
    ASSERT_TRUE(frame.has_value() && frame->has_value());
    EXPECT_NEAR(rig.painted()->exposure_us * 1e-6, exposure_s, 1e-6);
  }
  // And by command again.
  expect_frame(rig, 8e-3);
  ASSERT_TRUE(rig.camera().await_trigger(9e-3, 1).has_value());
  ASSERT_TRUE(camera.command("pulse"));
  const auto frame = rig.wait_for_frame();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  EXPECT_EQ(rig.painted()->exposure_us, 9000U);
}

TEST_F(Gige, APulseTooManyIsAFault) {
  auto camera = start_camera();
  Rig rig(kGige + "trigger_line = \"Line0\"\n");
  ASSERT_TRUE(rig.camera().await_trigger(1e-3, 1).has_value());
  ASSERT_TRUE(camera.command("pulse"));
  const auto frame = rig.wait_for_frame();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
  ASSERT_TRUE(camera.command("pulse"));
  // The pulse was answered once the frame was begun; here it may still be on its way.
  base::Result<void> told;
  ASSERT_TRUE(eventually([&] {
    told = rig.camera().arm();
    return !told.has_value();
  }));
  EXPECT_EQ(told.error().code, ErrorCode::device);
  EXPECT_THAT(told.error().text(), HasSubstr("nobody asked for"));
  ASSERT_TRUE(rig.camera().await_trigger(2e-3, 1).has_value());
  ASSERT_TRUE(camera.command("pulse"));
  const auto next = rig.wait_for_frame();
  ASSERT_TRUE(next.has_value() && next->has_value());
  EXPECT_EQ(rig.painted()->exposure_us, 2000U);
}

TEST_F(Gige, WithoutALineAPulseIsRefused) {
  const auto camera = start_camera();
  Rig rig(kGige);
  const auto refused = rig.camera().await_trigger(1e-3, 1);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::refused);
  EXPECT_THAT(refused.error().text(), HasSubstr("trigger_line"));
}

TEST_F(Gige, ACameraThatIsNotReadyIsNotTriggered) {
  auto camera = start_camera();
  Rig rig(kGige);
  expect_frame(rig, 1e-3);
  ASSERT_TRUE(camera.command("ready 0"));
  const auto refused = rig.camera().trigger(1e-3, 1);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::busy);
  EXPECT_THAT(refused.error().text(), HasSubstr("ready"));
  ASSERT_TRUE(camera.command("ready 1"));
  expect_frame(rig, 2e-3);
}

TEST_F(Gige, ItTellsItsTemperature) {
  auto camera = start_camera();
  Rig rig(kGige);
  ASSERT_TRUE(camera.command("temperature 41.25"));
  const auto told = rig.camera().temperature_c();
  ASSERT_TRUE(told.has_value()) << told.error().text();
  EXPECT_DOUBLE_EQ(told->value_or(0), 41.25);
  ASSERT_TRUE(camera.command("temperature -3.5"));
  EXPECT_DOUBLE_EQ(rig.camera().temperature_c()->value_or(0), -3.5);
}

TEST_F(Gige, ItIsFoundByItsNumberAndByItsName) {
  const auto camera = start_camera({"--serial", "RIG7"});
  const std::string rest = "transport = \"gige\"\nwidth = 64\nheight = 32\nopen_ms = 4000\n";
  {
    Rig rig("serial = \"RIG7\"\n" + rest);
    expect_frame(rig, 1e-3);
  }
  {
    Rig rig("id = \"Aravis-Fake-RIG7\"\n" + rest);
    expect_frame(rig, 1e-3);
  }
  try {
    Rig rig("serial = \"RIG8\"\n" + rest);
    FAIL() << "there is no such camera";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("not found"));
    EXPECT_THAT(error.what(), HasSubstr("RIG7")) << "what is there instead";
  }
}

TEST_F(Gige, WhatTheCameraHasNotIsSaidAtOnce) {
  const auto camera = start_camera();
  const auto error_of = [](const std::string& more) -> std::string {
    try {
      Rig rig("address = \"127.0.0.1\"\n" + more);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(error_of("pixel_format = \"BayerGB12Packed\""), HasSubstr("it has Bayer"));
  EXPECT_THAT(error_of("width = 4000"), HasSubstr("2048 x 2048"));
  EXPECT_THAT(error_of("offset_y = 2048"), HasSubstr("2048 x 2048"));
  EXPECT_THAT(error_of("features = [\"Warp=9\"]"), HasSubstr("Warp"));
  EXPECT_THAT(error_of("trigger_line = \"Line7\""), HasSubstr("Line7"));
  EXPECT_THAT(error_of("temperature_feature = \"Mood\""), HasSubstr("Mood"));
}

TEST_F(Gige, FeaturesAreSetFirst) {
  const auto camera = start_camera();
  Rig rig(kGige + "features = [\"TestRegister=77\", \"GainRaw=3\"]\n");
  ASSERT_TRUE(rig.take(1e-3).has_value());
  EXPECT_EQ(rig.painted()->gain, 0U) << "gain 1 is asked for after it";
}

TEST_F(Gige, TwoProgramsDoNotShareACamera) {
  const auto camera = start_camera();
  Rig rig(kGige);
  try {
    Rig second(kGige);
    FAIL() << "it was opened twice";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("another program"));
  }
  expect_frame(rig, 1e-3);
}

TEST_F(Gige, ABufferOfAnotherSizeIsRefusedAndTheFrameKept) {
  const auto camera = start_camera();
  Rig rig(kGige);
  ASSERT_TRUE(rig.camera().trigger(1e-3, 1).has_value());
  std::vector<std::uint16_t> small(10);
  const auto refused = rig.camera().fetch(small);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
  const auto frame = rig.wait_for_frame();
  ASSERT_TRUE(frame.has_value() && frame->has_value());
}

TEST_F(Gige, OfAMissingCameraOpeningSaysSo) {
  try {
    Rig rig(kGige + "open_ms = 1000\n");
    FAIL() << "there is none";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("camera 127.0.0.1"));
  }
}

}  // namespace
}  // namespace rig::drivers::aravis
