// The command timeout of a Tic: fed while rigd is well, and the end of every move when it is not.
#include <csignal>
#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/drivers/tic_axis/axis_fixture.h"

namespace rig::drivers::tic {
namespace {

using base::radians;
using std::chrono::milliseconds;
using test::log_text;
using test::Steady;
using testing::HasSubstr;

using TicTimeout = test::TicAxisTest;

// Fed while calls come; once none come for `silence_ms` the Tic brakes within silence, a quarter of its
// timeout and its timeout, although this process is well.
TEST_F(TicTimeout, StopsByItselfWhenRigdIsSilent) {
  auto settings = test::lab_settings();
  settings[0x09] = 200, settings[0x0A] = 0;  // command timeout: 200 ms
  test::LabTic lab({}, settings);
  open("silence_ms = 1000\n" + lab.table());
  reference(lab.tic);
  ASSERT_TRUE(axis().enable(true));
  ASSERT_TRUE(axis().move_to(radians(60), radians(10), radians(400)));
  const auto busy_until = Steady::now() + milliseconds(1500);
  while (Steady::now() < busy_until) {
    ASSERT_TRUE(state().moving);
    std::this_thread::sleep_for(milliseconds(100));
  }
  const auto last_call = Steady::now();
  ASSERT_EQ(lab.tic.error_status(), 0) << "seven times its command timeout have passed";
  EXPECT_TRUE(within(milliseconds(3000), [&] { return lab.tic.velocity() == 0; }));
  const auto stood_after = Steady::now() - last_call;
  EXPECT_GE(stood_after, milliseconds(1000)) << "as long as silence lasts it goes on";
  EXPECT_LE(stood_after, milliseconds(1000 + 50 + 200 + 400)) << "braking takes 25 ms";
  EXPECT_THAT(log_text(), HasSubstr("no call for"));
  // Told until the next command, and forgiven by it.
  EXPECT_THAT(state().fault, HasSubstr("command timeout"));
  EXPECT_TRUE(within(milliseconds(500), [&] { return log_text().find("fed again") != std::string::npos; }));
  EXPECT_THAT(state().fault, HasSubstr("command timeout"));
  ASSERT_TRUE(axis().stop());
  const AxisState after = state();
  EXPECT_EQ(after.fault, "");
  EXPECT_FALSE(after.enabled);
  EXPECT_FALSE(after.moving);
  EXPECT_TRUE(after.homed) << "it braked, and counted";
  ASSERT_TRUE(axis().enable(true));
  EXPECT_TRUE(stands(lab.tic, milliseconds(300))) << "the old target is forgotten";
}

TEST_F(TicTimeout, ATimeoutWhileItStandsIsNoFault) {
  auto settings = test::lab_settings();
  settings[0x09] = 100, settings[0x0A] = 0;
  test::LabTic lab({}, settings);
  open("silence_ms = 1000\n" + lab.table());
  reference(lab.tic);
  ASSERT_TRUE(axis().enable(true));
  EXPECT_EQ(state().fault, "");
  ASSERT_TRUE(within(milliseconds(2000), [&] { return (lab.tic.error_status() & 0x40U) != 0; }));
  EXPECT_EQ(state().fault, "");
  EXPECT_FALSE(state().enabled);
  // Nor is it taken for what stops the next move.
  ASSERT_TRUE(axis().enable(true));
  ASSERT_TRUE(axis().move_to(radians(1), radians(40), radians(400)));
  EXPECT_EQ(state().fault, "");
}

// The rigd of the next test, in a process of its own.
TEST_F(TicTimeout, DISABLED_MovesUntilItIsKilled) {
  open(std::getenv("RIG_TEST_TABLE"));
  ASSERT_TRUE(axis().enable(true));
  ASSERT_TRUE(axis().move_to(radians(60), radians(10), radians(400)));
  while (true) (void)axis().state();
}

pid_t start_the_other(const std::string& table) {
  const std::string filter = "--gtest_filter=TicTimeout.DISABLED_MovesUntilItIsKilled";
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::setenv("RIG_TEST_TABLE", table.c_str(), 1);
  ::execl("/proc/self/exe", "test", filter.c_str(), "--gtest_also_run_disabled_tests", nullptr);
  ::_exit(127);
}

TEST_F(TicTimeout, StopsWithinItsTimeoutWhenTheProcessDies) {
  test::LabTic lab;
  reference(lab.tic);
  const std::string text = lab.table();
  const pid_t child = start_the_other(text);
  ASSERT_GT(child, 0);
  ASSERT_TRUE(within(milliseconds(10000), [&] { return lab.tic.velocity() > 300; }));
  std::this_thread::sleep_for(milliseconds(1200));
  ASSERT_GT(lab.tic.velocity(), 300) << "fed for longer than its timeout";
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  const auto died = Steady::now();
  EXPECT_TRUE(within(milliseconds(3000), [&] { return lab.tic.velocity() == 0; }));
  EXPECT_LE(Steady::now() - died, milliseconds(1000 + 500)) << "its command timeout, and braking";
  EXPECT_LT(lab.tic.motor_position(), 60 * 40 - 100);
  // The next one finds it at rest, with its reference, and says what had been.
  open(text);
  EXPECT_THAT(log_text(), HasSubstr("before now: command timeout"));
  EXPECT_TRUE(state().homed);
  EXPECT_EQ(state().fault, "");
  EXPECT_TRUE(stands(lab.tic, milliseconds(200)));
}

}  // namespace
}  // namespace rig::drivers::tic
