// What step() makes of axes off their way, of limit switches, and of frames that are none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

#include "core/machine/motion.h"
#include "daemon/following.h"
#include "daemon/frame_check.h"
#include "daemon/motion.h"
#include "daemon/safety.h"
#include "daemon/step.h"
#include "tests/daemon/small_setup.h"

namespace rig::daemon::testing {
namespace {

using base::radians;
using base::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::size_t kPan = 2;

// Pan on its way from 0 to 50 degrees, sent at the state's time.
State moving_pan(const Setup& setup, double to_deg = 50) {
  State state;
  state.now = base::Time(seconds(1000));
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    state.axes[i].known = true;
    state.axes[i].last.homed = true;
    state.axes[i].last.position_rad = setup.rig.axes[i].home_rad;
  }
  Actions actions;
  JointAngles target{};
  target[kPan] = radians(to_deg);
  EXPECT_TRUE(
      begin_move(setup, state, actions, {false, false, true, false}, target, std::nullopt).has_value());
  return state;
}

drivers::AxisState pan_at(double angle_rad) {
  drivers::AxisState reading;
  reading.position_rad = angle_rad;
  reading.homed = reading.enabled = reading.moving = true;
  return reading;
}

TEST(Following, AnAxisOnItsPredictedWayFollows) {
  const daemon::Setup setup = small_setup();
  const machine::AxisConfig& axis = setup.rig.axes[kPan];
  State state = moving_pan(setup);
  const base::Time begin = state.now;
  for (double t = 0; t < 3; t += 0.05) {
    state.now = begin + seconds(t);
    for (const double age : {0.0, 0.4, 0.9}) {  // of the reading, or how late the move began
      const double share =
          machine::travel_share(radians(50), axis.max_velocity_rad_s, axis.max_acceleration_rad_s2, t - age);
      EXPECT_THAT(off_its_way(setup, state, kPan, pan_at(share * radians(50))), IsEmpty()) << t;
    }
  }
}

TEST(Following, AStalledOrStrayingAxisIsFound) {
  const daemon::Setup setup = small_setup();
  State state = moving_pan(setup);
  state.axes[kPan].last.position_rad = radians(5);
  state.now += seconds(1.8);
  EXPECT_THAT(off_its_way(setup, state, kPan, pan_at(radians(5))),
              HasSubstr("axis pan stalled at 5.000 deg"));
  EXPECT_THAT(off_its_way(setup, state, kPan, pan_at(radians(9))), HasSubstr("is off its way"));
  EXPECT_THAT(off_its_way(setup, state, kPan, pan_at(radians(60))), HasSubstr("is off its way"));
  EXPECT_THAT(off_its_way(setup, state, kPan, pan_at(radians(-6))), HasSubstr("is off its way"));
}

TEST(Following, StopsTheRigWhileItMoves) {
  const daemon::Setup setup = small_setup();
  const State state = moving_pan(setup);
  const Event late{state.now + seconds(1.8), AxisPolled{kPan, state.last_poll + 1, pan_at(0)}};
  const Step next = step(setup, state, late);
  EXPECT_THAT(next.state.stopped, HasSubstr("axis pan stalled"));
  // A reading that was asked for before the move says nothing about it.
  const Event old{state.now + seconds(1.8), AxisPolled{kPan, state.motion->sent_after_poll, pan_at(0)}};
  EXPECT_THAT(step(setup, state, old).state.stopped, IsEmpty());
}

TEST(LimitSwitch, FurtherInIsRefusedAndOutIsAllowed) {
  const daemon::Setup setup = small_setup();
  State state = moving_pan(setup);
  state.motion.reset();
  state.axes[kPan].last.at_low_limit = true;
  EXPECT_THAT(blocked_by_switch(setup, state, kPan, radians(-20)), HasSubstr("low limit switch"));
  EXPECT_THAT(blocked_by_switch(setup, state, kPan, radians(20)), IsEmpty());
  state.axes[kPan].last.at_low_limit = false;
  state.axes[kPan].last.at_high_limit = true;
  EXPECT_THAT(blocked_by_switch(setup, state, kPan, radians(20)), HasSubstr("high limit switch"));
  EXPECT_THAT(blocked_by_switch(setup, state, kPan, radians(-20)), IsEmpty());
  Actions actions;
  JointAngles target{};
  target[kPan] = radians(20);
  const auto refused = begin_move(setup, state, actions, {false, false, true, false}, target, std::nullopt);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, base::ErrorCode::refused);
  EXPECT_TRUE(actions.empty());
}

TEST(LimitSwitch, RunIntoOnTheWayStopsTheRigAndLeftBehindDoesNot) {
  const daemon::Setup setup = small_setup();
  const State state = moving_pan(setup);
  const machine::AxisConfig& axis = setup.rig.axes[kPan];
  const double there = radians(50) * machine::travel_share(radians(50), axis.max_velocity_rad_s,
                                                           axis.max_acceleration_rad_s2, 0.5);
  drivers::AxisState reading = pan_at(there);
  reading.at_low_limit = true;
  const auto after = [&] {
    return step(setup, state, {state.now + seconds(0.5), AxisPolled{kPan, state.last_poll + 1, reading}})
        .state.stopped;
  };
  EXPECT_THAT(after(), IsEmpty());
  reading.at_high_limit = true;
  EXPECT_THAT(after(), HasSubstr("axis pan ran into its high limit switch"));
}

TEST(FrameCheck, RefusesWhatNoSensorDelivers) {
  const machine::CameraConfig camera = small_setup().rig.camera;
  const auto width = static_cast<std::size_t>(camera.intrinsics.width);
  std::vector<std::uint16_t> pixels(width * static_cast<std::size_t>(camera.intrinsics.height), 70);
  EXPECT_THAT(damage_in(camera, pixels), IsEmpty());
  pixels[5 * width + 3] = 0;  // a dead pixel
  pixels[9] = 4095;
  EXPECT_THAT(damage_in(camera, pixels), IsEmpty());
  pixels[7 * width + 2] = 4096;
  EXPECT_THAT(damage_in(camera, pixels), HasSubstr("pixel (2, 7) is 4096, beyond the 12 bits"));
  pixels[7 * width + 2] = 70;
  std::fill_n(pixels.begin() + static_cast<std::ptrdiff_t>(8 * width), width, std::uint16_t{0});
  EXPECT_THAT(damage_in(camera, pixels), HasSubstr("line 8 is all zeros"));
  machine::CameraConfig black_at_zero = camera;
  black_at_zero.sensor.black_dn = 0;
  EXPECT_THAT(damage_in(black_at_zero, pixels), IsEmpty());
}

TEST(FrameCheck, RefusesAnotherFrameThanTheOneAskedFor) {
  State state;
  PendingFrame pending;
  pending.exposure_s = 0.01;
  FrameFetched fetched;
  fetched.info = {0.0101, 1, {}, 5};
  EXPECT_THAT(why_refused(state, pending, fetched), IsEmpty());
  state.last_frame = 5;
  EXPECT_THAT(why_refused(state, pending, fetched), HasSubstr("came a second time"));
  fetched.info.counter = 6;
  for (const double did : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    fetched.info.exposure_s = did;
    EXPECT_THAT(why_refused(state, pending, fetched), HasSubstr("does not say how it exposed"));
  }
  fetched.info.exposure_s = 0.03;
  EXPECT_THAT(why_refused(state, pending, fetched), HasSubstr("asked for were 10000 us"));
}

TEST(FrameCheck, ASnapWhoseFrameIsNoneFailsAndTheNextOneMayBegin) {
  const daemon::Setup setup = small_setup();
  State state = moving_pan(setup);
  state.motion.reset();
  state.snap = Snap{{{1, "c"}, 7}, false};
  state.frame = PendingFrame{};
  state.frame->exposure = 3;
  state.frame->exposure_s = 0.01;
  FrameFetched fetched;
  fetched.exposure = 3;
  fetched.slot = {1};
  fetched.info = {0.01, 1, {}, 1};
  fetched.damage = "line 0 is all zeros";
  const Step next = step(setup, state, {state.now, fetched});
  EXPECT_FALSE(next.state.snap || next.state.frame);
  EXPECT_THAT(next.state.stopped, IsEmpty());
  bool failed = false;
  bool released = false;
  for (const Action& action : next.actions) {
    if (const auto* reply = std::get_if<SendReply>(&action))
      failed |= reply->reply.outcome() == protocol::FAILED && reply->reply.id() == 7;
    released |= std::holds_alternative<ReleaseFrame>(action);
  }
  EXPECT_TRUE(failed && released);
}

TEST(Light, AReadingThatIsNoNumberStopsTheRig) {
  const daemon::Setup setup = small_setup();
  const State state = moving_pan(setup);
  drivers::LightState light;
  light.level = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(step(setup, state, {state.now, LightPolled{1, light}}).state.stopped,
            "the light reports no level");
}

}  // namespace
}  // namespace rig::daemon::testing
