// The disk refuses at every moment of a job: nothing that was committed is lost, what failed is an error that
// says why, and the job goes on once there is room.
#include <cerrno>
#include <gmock/gmock.h>

#include "tests/core/scan/recorded_job.h"

namespace rig::scan::testing {
namespace {

using test::Operation;
using test::Recorded;

class FullDisk : public ::testing::TestWithParam<int> {};

TEST_P(FullDisk, LosesNothingAndGoesOnWhenThereIsRoom) {
  const UndisturbedScan undisturbed;
  const auto expected = frames_below(undisturbed.path());
  const test::TemporaryFolder folder;
  bool failed = true;
  int failures = 0;
  for (int n = 1; failed; n += GetParam() == ENOSPC ? 1 : 7) {
    SCOPED_TRACE(fmt::format("from operation {} on: {}", n, std::strerror(GetParam())));
    const fs::path root = folder / ("disk-" + std::to_string(n));
    fs::create_directory(root);
    const fs::path scan = root / "scan";
    Recorded recorded(root);
    int seen = 0;
    recorded.log.refuse = [&](const Operation&) { return ++seen >= n ? GetParam() : 0; };
    const auto done = run_job(scan, recorded.log);
    failed = seen >= n;
    if (!done) {
      EXPECT_FALSE(done.error().what.empty());
      EXPECT_THAT(done.error().where, ::testing::HasSubstr(root.string()));
      ++failures;
    }
    recorded.log.refuse = nullptr;
    const auto reached = notes_before(recorded.log, recorded.log.operations().size());
    ASSERT_NO_FATAL_FAILURE(expect_recovered(scan, reached));
    const auto again = run_job(scan, recorded.log);
    ASSERT_TRUE(again.has_value()) << again.error().text();
    EXPECT_TRUE(verify_scan(scan, {}).value().complete());
    EXPECT_TRUE(frames_below(scan) == expected) << "differs from the undisturbed scan";
    if (HasFailure()) return;
    fs::remove_all(root);
  }
  EXPECT_GT(failures, 15);
}

INSTANTIATE_TEST_SUITE_P(Because, FullDisk, ::testing::Values(ENOSPC, EROFS, EIO));

}  // namespace
}  // namespace rig::scan::testing
