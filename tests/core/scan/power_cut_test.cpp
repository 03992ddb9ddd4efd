// The power goes at every moment of a job, and whatever the disk may hold then is opened as rigd opens it.
#include <gmock/gmock.h>

#include "tests/core/scan/recorded_job.h"
#include "tests/core/seed.h"

namespace rig::scan::testing {
namespace {

using test::Recorded;
using test::Unflushed;

constexpr std::array kAll{Unflushed::dropped,      Unflushed::kept,          Unflushed::torn,
                          Unflushed::only_entries, Unflushed::only_contents, Unflushed::some};

std::map<std::string, std::string> undisturbed_frames() {
  return frames_below(UndisturbedScan().path());
}

// The job goes on after the restart, and the finished scan is the undisturbed one.
void expect_goes_on(const fs::path& scan, const std::map<std::string, std::string>& expected) {
  Recorded recorded(scan.parent_path());
  const auto done = run_job(scan, recorded.log);
  ASSERT_TRUE(done.has_value()) << done.error().text();
  EXPECT_TRUE(verify_scan(scan, {}).value().complete());
  EXPECT_TRUE(frames_below(scan) == expected) << "differs from the undisturbed scan";
}

class PowerCut : public ::testing::Test {
 protected:
  // What the disk may hold after the n-th operation, in a folder of its own.
  fs::path restored(const Recorded& recorded, std::size_t n, Unflushed unflushed, base::Random& random) {
    const fs::path root = folder_ / ("restored-" + std::to_string(++restored_));
    recorded.image_after(n).restore(root, unflushed, random);
    return root;
  }

  const test::TemporaryFolder folder_;
  const std::map<std::string, std::string> expected_ = undisturbed_frames();
  int restored_ = 0;
};

TEST_F(PowerCut, AtEveryMomentOfAJob) {
  base::Random random(test::seed(3));
  const fs::path root = folder_ / "disk";
  fs::create_directory(root);
  std::optional<Recorded> recorded(root);
  const auto done = run_job(root / "scan", recorded->log);
  ASSERT_TRUE(done.has_value()) << done.error().text();
  ASSERT_TRUE(frames_below(root / "scan") == expected_);
  // More than the notes: the layer did record.
  ASSERT_GT(recorded->log.operations().size(), 100U);

  for (std::size_t n = 0; n <= recorded->log.operations().size(); ++n) {
    const auto reached = notes_before(recorded->log, n);
    for (const Unflushed unflushed : kAll) {
      SCOPED_TRACE(fmt::format("after {} operations, the last: {}; unflushed {}", n,
                               n == 0 ? "none" : recorded->log.operations()[n - 1].text(),
                               static_cast<int>(unflushed)));
      const fs::path disk = restored(*recorded, n, unflushed, random);
      ASSERT_NO_FATAL_FAILURE(expect_recovered(disk / "scan", reached));
      // Once recovered, the disks are of few kinds: two of them stand for all.
      if (unflushed == Unflushed::dropped || unflushed == Unflushed::some) {
        ASSERT_NO_FATAL_FAILURE(expect_goes_on(disk / "scan", expected_));
      }
      if (HasFailure()) return;
      fs::remove_all(disk);
    }
  }
}

// What makes the others worth something: a disk that is asked to flush less than it was loses a scan.
TEST_F(PowerCut, WithoutFlushesItIsLost) {
  base::Random random(1);
  const fs::path root = folder_ / "disk";
  fs::create_directory(root);
  Recorded recorded(root);
  ASSERT_TRUE(run_job(root / "scan", recorded.log).has_value());
  const auto without = [&](test::Operation::Kind left_out) {
    test::DiskImage image = recorded.before;
    for (const test::Operation& operation : recorded.log.operations()) {
      if (operation.kind != left_out) image.apply(operation);
    }
    const fs::path disk = folder_ / ("without-" + std::to_string(static_cast<int>(left_out)));
    image.restore(disk, Unflushed::dropped, random);
    return disk / "scan";
  };
  EXPECT_FALSE(fs::exists(without(test::Operation::Kind::flush_folder)));
  const fs::path scan = without(test::Operation::Kind::flush);
  EXPECT_TRUE(fs::exists(scan / "frames" / "000003" / "02.tif"));
  EXPECT_EQ(fs::file_size(scan / "frames" / "000003" / "02.tif"), 0U);
  EXPECT_FALSE(Journal::open(journal_path(scan)).has_value());
}

// The restart is work on the disk too, and the power may go again and again.
TEST_F(PowerCut, AgainAfterTheRestart) {
  base::Random random(test::seed(4));
  for (int trial = 0; trial < 25; ++trial) {
    fs::path root = folder_ / ("disk-" + std::to_string(trial));
    fs::create_directory(root);
    std::set<std::string> reached;
    for (int cut = 0; cut < 4; ++cut) {
      Recorded recorded(root);
      const auto done = run_job(root / "scan", recorded.log);
      ASSERT_TRUE(done.has_value()) << done.error().text();
      const auto n = static_cast<std::size_t>(random.below(recorded.log.operations().size() + 1));
      SCOPED_TRACE(fmt::format("trial {}, cut {} after {} operations", trial, cut, n));
      reached.merge(notes_before(recorded.log, n));
      const fs::path next = restored(recorded, n, kAll[random.below(kAll.size())], random);
      fs::remove_all(root);
      root = next;
      if (cut % 2 == 0) continue;  // what comes next begins on the raw disk
      ASSERT_NO_FATAL_FAILURE(expect_recovered(root / "scan", reached));
    }
    ASSERT_NO_FATAL_FAILURE(expect_recovered(root / "scan", reached));
    ASSERT_NO_FATAL_FAILURE(expect_goes_on(root / "scan", expected_));
    if (HasFailure()) return;
    fs::remove_all(root);
  }
}

// A pose that is done is taken again: at every moment the journal's frames are those on the disk.
TEST_F(PowerCut, WhileAPoseIsTakenAgain) {
  base::Random random(test::seed(5));
  const fs::path root = folder_ / "disk";
  fs::create_directory(root);
  {
    test::OperationLog unused(root);
    ASSERT_TRUE(run_job(root / "scan", unused).has_value());
  }
  const auto before = frames_below(root / "scan");
  Recorded recorded(root);
  {
    auto journal = Journal::open(journal_path(root / "scan"));
    ASSERT_TRUE(journal.has_value()) << journal.error().text();
    const auto taken = take_pose(root / "scan", *journal, 2, 5);
    ASSERT_TRUE(taken.has_value()) << taken.error().text();
    recorded.log.note("committed");
    ASSERT_TRUE(discard_bracket(root / "scan", 2).has_value());
  }
  const auto after = frames_below(root / "scan");
  ASSERT_FALSE(before == after);
  for (std::size_t n = 0; n <= recorded.log.operations().size(); ++n) {
    for (const Unflushed unflushed : kAll) {
      SCOPED_TRACE(fmt::format("after {} operations, unflushed {}", n, static_cast<int>(unflushed)));
      const fs::path disk = restored(recorded, n, unflushed, random);
      ASSERT_NO_FATAL_FAILURE(expect_recovered(disk / "scan", {"created"}));
      const auto frames = frames_below(disk / "scan");
      const bool reported = notes_before(recorded.log, n).count("committed") != 0;
      EXPECT_TRUE(frames == after || (frames == before && !reported));
      if (HasFailure()) return;
      fs::remove_all(disk);
    }
  }
}

}  // namespace
}  // namespace rig::scan::testing
