// A Tic that is set otherwise than rig.toml says, and one that does not obey.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/tic_axis/axis_fixture.h"

namespace rig::drivers::tic {
namespace {

using base::ErrorCode;
using std::chrono::milliseconds;
using test::log_text;
using testing::HasSubstr;

using TicMismatch = test::TicAxisTest;

TEST_F(TicMismatch, AMismatchIsAFaultThatSaysHowToMendItAndStopsStillWork) {
  auto settings = test::lab_settings();
  settings[0x41] = 0;
  test::LabTic lab({}, settings);
  open(lab.table());
  EXPECT_THAT(state().fault, HasSubstr("step_mode is 1 in the Tic, 8 in rig.toml"));
  EXPECT_THAT(state().fault, HasSubstr("ticcmd -d 00123456 --settings"));
  EXPECT_THAT(log_text(), HasSubstr("step_mode is 1 in the Tic"));
  EXPECT_EQ(axis().enable(true).error().code, ErrorCode::device);
  EXPECT_EQ(axis().home().error().code, ErrorCode::device);
  EXPECT_EQ(axis().move_to(0, 0.1, 1).error().code, ErrorCode::device);
  // Somebody else had set it going.
  command(lab.tic, 0x85, 0);
  command(lab.tic, 0x83, 0);
  command(lab.tic, 0xE3, 1'000'000);
  ASSERT_TRUE(within(milliseconds(500), [&] { return lab.tic.velocity() > 50; }));
  EXPECT_TRUE(state().moving);
  EXPECT_TRUE(axis().stop());
  EXPECT_EQ(lab.tic.velocity(), 0);
  EXPECT_EQ(lab.tic.setting_writes_seen(), 0) << "never silently";
  // Somebody mends it.
  lab.tic.set_settings(test::lab_settings());
  EXPECT_EQ(state().fault, "");
  EXPECT_TRUE(axis().enable(true));
  EXPECT_TRUE(state().enabled);
}

TEST_F(TicMismatch, SettingsAreWrittenWhereThatIsAskedFor) {
  auto settings = test::lab_settings();
  settings[0x41] = 0;
  settings[0x40] = 6;
  test::LabTic lab({}, settings);
  const std::string text = "write_settings = true\n" + lab.table("arm", "command_timeout_ms = 700");
  open(text);
  EXPECT_EQ(state().fault, "");
  EXPECT_EQ(lab.tic.settings()[0x41], 3);
  EXPECT_EQ(lab.tic.settings()[0x40], 46);
  EXPECT_EQ(lab.tic.settings()[0x09] + 256 * lab.tic.settings()[0x0A], 700);
  EXPECT_THAT(log_text(), HasSubstr("written to it"));
  EXPECT_TRUE(axis().enable(true));
  const int writes = lab.tic.setting_writes_seen();
  EXPECT_EQ(writes, 4);
  close();
  open(text);
  EXPECT_EQ(state().fault, "");
  EXPECT_EQ(lab.tic.setting_writes_seen(), writes) << "its memory wears: only what differs";
}

TEST_F(TicMismatch, NothingIsWrittenToATicThatTurns) {
  auto settings = test::lab_settings();
  settings[0x40] = 6;
  test::LabTic lab({}, settings);
  command(lab.tic, 0x85, 0);
  command(lab.tic, 0x83, 0);
  command(lab.tic, 0xE3, 10'000'000);
  ASSERT_TRUE(within(milliseconds(500), [&] { return lab.tic.velocity() > 100; }));
  open("write_settings = true\n" + lab.table());
  const auto now = axis().state();
  ASSERT_FALSE(now);
  EXPECT_EQ(now.error().code, ErrorCode::lost);
  EXPECT_THAT(now.error().what, HasSubstr("while the motor turns"));
  EXPECT_EQ(lab.tic.setting_writes_seen(), 0);
}

// In another control mode commands to move or to halt are ignored without a word.
TEST_F(TicMismatch, ATicThatDoesNotObeyIsCutOff) {
  test::LabTic lab;
  open(lab.table());
  set_off(lab.tic);
  constexpr std::uint16_t kControlMode = 0x01, kEncoderPosition = 6;
  (void)lab.tic.control({0x40, 0x13, kEncoderPosition, kControlMode, 0}, {});
  EXPECT_TRUE(axis().stop());
  EXPECT_EQ(lab.tic.velocity(), 0);
  EXPECT_FALSE(lab.tic.energized());
  close();
  open(lab.table());
  EXPECT_THAT(state().fault, HasSubstr("control_mode: serial"));
}

}  // namespace
}  // namespace rig::drivers::tic
