// What long work needs: progress, interruption, all cores.
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <gtest/gtest.h>
#include <stdexcept>
#include <vector>

#include "core/base/interrupt.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/base/units.h"

namespace rig::base {
namespace {

TEST(Progress, DurationsReadAsOnAClock) {
  EXPECT_EQ(format_duration(0), "0:00");
  EXPECT_EQ(format_duration(0.4), "0:00");
  EXPECT_EQ(format_duration(41), "0:41");
  EXPECT_EQ(format_duration(59.6), "1:00");
  EXPECT_EQ(format_duration(3599), "59:59");
  EXPECT_EQ(format_duration(3600), "1:00:00");
  EXPECT_EQ(format_duration(3727), "1:02:07");
  EXPECT_EQ(format_duration(100 * 3600), "100:00:00");
}

TEST(Progress, EndsWithOneWholeLineInALog) {
  testing::internal::CaptureStderr();
  {
    Progress progress("assemble", 4, "poses");
    progress.add();
    progress.add(2);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "assemble: 3/4 poses, 75 %, 0:00 in all\n")
      << "it says what was done, not what was wanted";
}

TEST(Interrupt, TheFirstSignalAsksTheSecondEnds) {
  EXPECT_FALSE(interrupted());
  EXPECT_EXIT(
      {
        catch_interrupts();
        std::raise(SIGINT);
        std::_Exit(interrupted() ? 42 : 1);
      },
      testing::ExitedWithCode(42), "");
  EXPECT_EXIT(
      {
        catch_interrupts();
        std::raise(SIGTERM);
        std::raise(SIGTERM);
        std::_Exit(1);
      },
      testing::KilledBySignal(SIGTERM), "");
}

TEST(Interrupt, TheErrorSaysWhatIsLeft) {
  const Result<int> result = interrupted_error("12 poses are complete");
  EXPECT_EQ(result.error().code, ErrorCode::interrupted);
  EXPECT_EQ(result.error().text(), "interrupted (12 poses are complete)");
}

TEST(ParallelFor, CoversEveryItemOnce) {
  std::vector<std::atomic<int>> visits(10'007);
  parallel_for(visits.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) ++visits[i];
  });
  for (const auto& n : visits) ASSERT_EQ(n, 1);
  parallel_for(0, 64, [](std::size_t, std::size_t) { FAIL() << "there is nothing to do"; });
}

TEST(ParallelFor, HandsExceptionsOn) {
  EXPECT_THROW(parallel_for(1000, 1,
                            [](std::size_t begin, std::size_t) {
                              if (begin == 500) throw std::runtime_error("bug");
                            }),
               std::runtime_error);
}

TEST(Units, ThereAndBack) {
  EXPECT_DOUBLE_EQ(radians(180), kPi);
  EXPECT_DOUBLE_EQ(degrees(radians(23.7)), 23.7);
  EXPECT_DOUBLE_EQ(mm_from_metres(metres_from_mm(25.4)), 25.4);
}

}  // namespace
}  // namespace rig::base
