// The service manager is fed as long as every part answers, and not a moment longer.
#include "daemon/watchdog.h"

#include <future>
#include <gtest/gtest.h>

#include "daemon/bus_worker.h"
#include "daemon/service_manager.h"
#include "tests/core/temporary_folder.h"
#include "tests/daemon/notify_socket.h"

namespace rig::daemon {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPatience{20000};
constexpr milliseconds kPeriod{40};

WatchedPart part_of(const std::string& name, BusWorker& worker) {
  return {name, [&worker](std::function<void()> answer) { worker.queue(std::move(answer)); }};
}

TEST(Watchdog, FeedsAgainAndAgainWhileAllAnswer) {
  const test::TemporaryFolder folder;
  const test::NotifySocket manager(folder / "notify");
  const auto clock = base::make_system_clock();
  BusWorker first(*clock, "first");
  BusWorker second(*clock, "second");
  const Watchdog watchdog({part_of("first", first), part_of("second", second)}, kPeriod, &notify_alive);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(manager.next(kPatience), "WATCHDOG=1");
}

TEST(Watchdog, OneBlockedPartEndsTheFeedingAndItsAnswerBeginsItAgain) {
  const test::TemporaryFolder folder;
  const test::NotifySocket manager(folder / "notify");
  const auto clock = base::make_system_clock();
  BusWorker well(*clock, "well");
  BusWorker ill(*clock, "ill");
  const Watchdog watchdog({part_of("well", well), part_of("ill", ill)}, kPeriod, &notify_alive);
  ASSERT_EQ(manager.next(kPatience), "WATCHDOG=1");

  std::promise<void> blocked;
  std::promise<void> go;
  ill.queue([&] {
    blocked.set_value();
    go.get_future().wait();
  });
  blocked.get_future().wait();
  // One round may have been answered before the block.
  std::string last = manager.next(5 * kPeriod);
  if (!last.empty()) last = manager.next(5 * kPeriod);
  EXPECT_EQ(last, "");
  EXPECT_EQ(manager.next(5 * kPeriod), "");
  go.set_value();
  EXPECT_EQ(manager.next(kPatience), "WATCHDOG=1");
}

TEST(Watchdog, EndsWhileAPartIsSilentAndALateAnswerHarmsNobody) {
  std::function<void()> late;
  {
    const Watchdog watchdog({{"silent", [&late](std::function<void()> answer) { late = std::move(answer); }}},
                            kPeriod, [] { ADD_FAILURE() << "fed without an answer"; });
  }
  if (late) late();
}

TEST(ServiceManager, ThePeriodIsThatOfThisProcess) {
  ::unsetenv("WATCHDOG_USEC");
  ::unsetenv("WATCHDOG_PID");
  EXPECT_FALSE(watchdog_period().has_value());
  ::setenv("WATCHDOG_USEC", "30000000", 1);
  EXPECT_EQ(watchdog_period(), std::chrono::seconds(30));
  ::setenv("WATCHDOG_PID", "1", 1);
  EXPECT_FALSE(watchdog_period().has_value()) << "it is meant for another process";
  ::unsetenv("WATCHDOG_USEC");
  ::unsetenv("WATCHDOG_PID");
}

}  // namespace
}  // namespace rig::daemon
