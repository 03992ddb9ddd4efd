// The program of [notify]: it gets the report, and rigd never waits for it longer than it said.
#include "daemon/notifier.h"

#include <filesystem>
#include <gtest/gtest.h>

#include "core/base/files.h"
#include "tests/core/temporary_folder.h"

namespace rig::daemon {
namespace {

machine::NotifyConfig shell(const std::string& script, double timeout_s = 30) {
  return {{"/bin/sh", "-c", script, "notify"}, timeout_s};
}

TEST(Notifier, GivesOccasionAndReport) {
  const test::TemporaryFolder folder;
  const std::string out = folder / "told";
  const auto done = run_notify(shell("echo $1 >" + out + "; cat >>" + out), "complete", "Job 1\nall good\n");
  ASSERT_TRUE(done.has_value()) << done.error().text();
  EXPECT_EQ(base::read_file(out).value(), "complete\nJob 1\nall good\n");
}

TEST(Notifier, AProgramThatReadsNothingKeepsNobodyWaiting) {
  EXPECT_TRUE(run_notify(shell("exit 0"), "held", std::string(1 << 22, 'x')).has_value());
}

TEST(Notifier, SaysWhatWentWrong) {
  const auto status = run_notify(shell("exit 3"), "failed", "");
  ASSERT_FALSE(status.has_value());
  EXPECT_NE(status.error().text().find("status 3"), std::string::npos) << status.error().text();
  const auto missing = run_notify({{"/no/such/program"}, 5}, "failed", "");
  ASSERT_FALSE(missing.has_value());
  EXPECT_NE(missing.error().text().find("/no/such/program"), std::string::npos) << missing.error().text();
}

TEST(Notifier, KillsWhatIsNotDoneInTime) {
  const auto late = run_notify(shell("cat >/dev/null; exec /bin/sleep 1000", 0.2), "suspended", "text");
  ASSERT_FALSE(late.has_value());
  EXPECT_EQ(late.error().code, base::ErrorCode::timeout);
}

TEST(Notifier, TellsWhatIsQueuedBeforeItEnds) {
  const test::TemporaryFolder folder;
  const std::string out = folder / "told";
  {
    Notifier notifier(shell("echo $1 >>" + out));
    notifier.tell("suspended", "");
    notifier.tell("complete", "");
  }
  EXPECT_EQ(base::read_file(out).value(), "suspended\ncomplete\n");
}

TEST(Notifier, SaysWhenSomebodyWasTold) {
  const test::TemporaryFolder folder;
  const std::string out = folder / "told";
  std::string heard;
  Notifier notifier(shell("echo $1 >>" + out + "; exit 3"));
  notifier.tell("aborted", "", [&] { heard = base::read_file(out).value(); });
  notifier.finish();
  EXPECT_EQ(heard, "aborted\n") << "after the program, whatever became of it";
}

TEST(Notifier, WithoutACommandNothingHappensAndNothingIsLeftToTell) {
  Notifier notifier({});
  bool told = false;
  notifier.tell("complete", "", [&] { told = true; });
  EXPECT_TRUE(told);
}

}  // namespace
}  // namespace rig::daemon
