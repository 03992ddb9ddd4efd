// Making a scan, whole or not at all; storing, publishing and discarding brackets; tidying up after a crash
// at any point of that.
#include "core/scan/scan_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"
#include "core/scan/verify.h"
#include "tests/core/scan/small_scan.h"

namespace rig::scan {
namespace {

using base::ErrorCode;
using namespace rig::scan::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

// As statfs(2) tells them.
TEST(NetworkDisk, IsKnownByTheNumberOfItsFileSystem) {
  for (const unsigned long network : {0x6969UL, 0x517BUL, 0xFF534D42UL, 0xFE534D42UL, 0x65735546UL,
                                      0x5346414FUL, 0x6B414653UL, 0x00C36400UL}) {
    EXPECT_TRUE(is_network_file_system(network)) << std::hex << network;
  }
  // ext4, XFS, Btrfs, tmpfs, overlayfs, ZFS, exFAT; none
  for (const unsigned long local :
       {0xEF53UL, 0x58465342UL, 0x9123683EUL, 0x01021994UL, 0x794C7630UL, 0x2FC12FC1UL, 0x2011BAB0UL, 0UL}) {
    EXPECT_FALSE(is_network_file_system(local)) << std::hex << local;
  }
  const test::TemporaryFolder folder;
  EXPECT_TRUE(refuse_network_disk(folder.path()).has_value());
}

TEST(ScanNames, SortAsTheirNumbers) {
  EXPECT_EQ(frames_folder("scan", 12), fs::path("scan/frames/000012"));
  EXPECT_EQ(part_folder("scan", 12), fs::path("scan/frames/000012.part"));
  EXPECT_EQ(frames_folder("scan", 1234567), fs::path("scan/frames/1234567"));
  EXPECT_EQ(frame_name(0), "00.tif");
  EXPECT_EQ(frame_name(31), "31.tif");
  EXPECT_EQ(journal_path("scan"), fs::path("scan/journal.sqlite"));
}

class CreateScan : public ::testing::Test {
 protected:
  [[nodiscard]] base::Result<void> creating(const fs::path& scan) const {
    return create_scan(scan, machine::shipped_rig_text(), job_text());
  }
  void expect_refused(const fs::path& scan, ErrorCode code, const std::string& where) const {
    const auto before = test::everything_in(folder_.path());
    const auto made = creating(scan);
    ASSERT_FALSE(made.has_value());
    EXPECT_EQ(made.error().code, code) << made.error().text();
    EXPECT_THAT(made.error().where, HasSubstr(where));
    EXPECT_EQ(test::everything_in(folder_.path()), before);
  }
  // What stands in the folder in which scans are made here.
  [[nodiscard]] std::vector<std::string> beside() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path()))
      names.push_back(entry.path().filename().string());
    return names;
  }
  void expect_scan_at(const fs::path& scan) const {
    EXPECT_EQ(test::everything_in(scan),
              (std::set<std::string>{"frames", "job.toml", "journal.sqlite", "rig.toml"}));
    const auto view = open_scan(scan);
    ASSERT_TRUE(view.has_value()) << view.error().text();
    EXPECT_EQ(view->rig.name, "virtual rig");
    EXPECT_EQ(view->job.name, "small");
    ASSERT_EQ(view->plan.size(), static_cast<std::size_t>(kPoses));
    for (std::size_t i = 0; i < view->plan.size(); ++i)
      EXPECT_EQ(view->plan[i].target_rad, view->job.poses[i]);
    EXPECT_THAT(view->poses, IsEmpty());
  }

  const test::TemporaryFolder folder_;
};

TEST_F(CreateScan, MakesAFolderWithAllThatAScanNeeds) {
  const fs::path scan = folder_ / "scan";
  const auto made = creating(scan);
  ASSERT_TRUE(made.has_value()) << made.error().text();
  expect_scan_at(scan);
  EXPECT_EQ(test::bytes_in(scan / "rig.toml"), machine::shipped_rig_text());
  EXPECT_EQ(test::bytes_in(scan / "job.toml"), job_text());
  EXPECT_THAT(beside(), ElementsAre("scan"));
}

TEST_F(CreateScan, MakesTheFoldersAboveItToo) {
  ASSERT_TRUE(creating(folder_ / "2026" / "cloth" / "scan").has_value());
  expect_scan_at(folder_ / "2026" / "cloth" / "scan");
}

TEST_F(CreateScan, TakesAnEmptyFolder) {
  fs::create_directory(folder_ / "scan");
  const auto made = creating(folder_ / "scan");
  ASSERT_TRUE(made.has_value()) << made.error().text();
  expect_scan_at(folder_ / "scan");
}

TEST_F(CreateScan, ASlashAtTheEndIsNoOtherFolder) {
  const auto made = creating(folder_ / "scan/");
  ASSERT_TRUE(made.has_value()) << made.error().text();
  expect_scan_at(folder_ / "scan");
  EXPECT_THAT(beside(), ElementsAre("scan"));
}

TEST_F(CreateScan, RefusesWhatIsInUse) {
  fs::create_directory(folder_ / "full");
  test::put_bytes(folder_ / "full" / "notes.txt", "mine");
  test::put_bytes(folder_ / "file", "mine too");
  expect_refused(folder_ / "full", ErrorCode::refused, "full");
  expect_refused(folder_ / "file", ErrorCode::refused, "file");
  expect_refused(folder_ / "file" / "scan", ErrorCode::io, "file");
  EXPECT_EQ(test::bytes_in(folder_ / "full" / "notes.txt"), "mine");
  EXPECT_EQ(test::bytes_in(folder_ / "file"), "mine too");
  ASSERT_TRUE(creating(folder_ / "scan").has_value());
  expect_refused(folder_ / "scan", ErrorCode::refused, "scan");
}

TEST_F(CreateScan, RefusesFilesWithMistakesBeforeAnythingIsMade) {
  const auto bad_rig = create_scan(folder_ / "scan", "format = 1\nname = 3\n", job_text());
  ASSERT_FALSE(bad_rig.has_value());
  EXPECT_THAT(bad_rig.error().text(), HasSubstr("rig.toml:2"));
  const auto bad_job =
      create_scan(folder_ / "scan", machine::shipped_rig_text(), job_text() + "\nnonsense = 1\n");
  ASSERT_FALSE(bad_job.has_value());
  EXPECT_THAT(bad_job.error().text(), HasSubstr("job.toml"));
  EXPECT_THAT(test::everything_in(folder_.path()), IsEmpty());
}

TEST_F(CreateScan, LeavesNothingOnADiskThatFillsUp) {
  fs::create_directory(folder_ / "scan");
  const auto before = test::everything_in(folder_.path());
  int failures = 0;
  for (const rlim_t most : {0, 500, 2000, 4096, 8192, 12'000, 16'384, 30'000}) {
    const int outcome = test::on_full_disk(most, [&] {
      const auto made = creating(folder_ / "scan");
      if (made) return 2;
      return made.error().where.empty() ? 3 : 1;
    });
    if (outcome == 2) break;
    ASSERT_EQ(outcome, 1) << most;
    EXPECT_EQ(test::everything_in(folder_.path()), before) << most;
    ++failures;
  }
  EXPECT_GE(failures, 4);
}

TEST(OpenScan, SaysWhatIsMissing) {
  const test::TemporaryFolder folder;
  const auto none = open_scan(folder / "scan");
  ASSERT_FALSE(none.has_value());
  EXPECT_EQ(none.error().code, ErrorCode::not_found);
  for (const char* file : {"rig.toml", "job.toml", "journal.sqlite"}) {
    const SmallScan scan;
    fs::remove(scan.path() / file);
    const auto view = open_scan(scan.path());
    ASSERT_FALSE(view.has_value()) << file;
    EXPECT_EQ(view.error().code, ErrorCode::not_found) << view.error().text();
    EXPECT_THAT(view.error().where, HasSubstr(file));
  }
}

TEST(Bracket, IsStoredAsidePublishedAndFound) {
  const SmallScan scan;
  const std::string hash = scan.store(2, 0);
  EXPECT_EQ(scan.frames(), (std::set<std::string>{"000002.part", "000002.part/00.tif"}));
  EXPECT_EQ(hash, base::sha256_of_file(part_folder(scan.path(), 2) / "00.tif").value());
  scan.store(2, 1);
  scan.publish(2);
  EXPECT_EQ(scan.frames(), (std::set<std::string>{"000002", "000002/00.tif", "000002/01.tif"}));
  const auto frame = read_frame(scan.frame(2, 1));
  ASSERT_TRUE(frame.has_value()) << frame.error().text();
  EXPECT_EQ(frame->pixels, SmallScan::pixels(2, 1, 1));
  EXPECT_EQ(frame->facts.row, 2);
  EXPECT_EQ(frame->facts.index, 1);
}

TEST(Bracket, IsDiscardedWholeAndAlone) {
  const SmallScan scan;
  scan.take(1);
  scan.store(1, 0, 2);
  scan.store(2, 0);
  ASSERT_TRUE(discard_bracket(scan.path(), 1).has_value());
  EXPECT_EQ(scan.frames(), (std::set<std::string>{"000001", "000001/00.tif", "000001/01.tif", "000001/02.tif",
                                                  "000002.part", "000002.part/00.tif"}));
  EXPECT_TRUE(discard_bracket(scan.path(), 1).has_value()) << "there is nothing to do, and that is no error";
}

TEST(Bracket, ARetakeIsExchangedForTheTakeBefore) {
  const SmallScan scan;
  scan.take(1);
  scan.store(1, 0, 2);
  scan.publish(1);
  EXPECT_EQ(scan.frames(),
            (std::set<std::string>{"000001", "000001/00.tif", "000001.part", "000001.part/00.tif",
                                   "000001.part/01.tif", "000001.part/02.tif"}))
      << "the take before is there until the journal knows the new one";
  ASSERT_TRUE(discard_bracket(scan.path(), 1).has_value());
  // Not a mixture of both: the retake has one frame.
  EXPECT_EQ(scan.frames(), (std::set<std::string>{"000001", "000001/00.tif"}));
  EXPECT_EQ(read_frame(scan.frame(1, 0)).value().pixels, SmallScan::pixels(1, 0, 2));
}

TEST(Bracket, OfNothingCannotBePublished) {
  const SmallScan scan;
  const auto done = publish_bracket(scan.path(), 3);
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().code, ErrorCode::not_found);
  EXPECT_THAT(scan.frames(), IsEmpty());
}

TEST(Bracket, AFrameThatDoesNotFitOnTheDiskIsAnError) {
  const SmallScan scan;
  const int outcome = test::on_full_disk(300, [&] {
    const auto hash =
        store_frame(scan.path(), some_facts(0, 0), kWidth, kHeight, SmallScan::pixels(0, 0, 1).data());
    return hash ? 0 : hash.error().code == ErrorCode::io ? 1 : 2;
  });
  EXPECT_EQ(outcome, 1);
  scan.tidy();
  EXPECT_THAT(scan.frames(), IsEmpty());
}

// A capture stores each frame, publishes the bracket and commits it; a crash may come after any of these
// steps.
class Crash : public ::testing::TestWithParam<int> {
 protected:
  static constexpr int kSteps = kFrames + 2;

  // The first `steps` of: store each frame, publish, commit.
  static void run(const SmallScan& scan, std::int64_t row, int steps) {
    PoseRecord pose;
    if (steps >= kFrames) {
      pose = scan.store_all(row);
    } else {
      for (int index = 0; index < steps; ++index) scan.store(row, index);
    }
    if (steps > kFrames) scan.publish(row);
    if (steps > kFrames + 1) scan.commit(pose);
  }
};

TEST_P(Crash, LeavesThePoseCommittedOrAsIfItNeverWas) {
  const int steps = GetParam();
  const SmallScan scan;
  scan.take(0);
  const auto before = scan.frames();
  run(scan, 1, steps);
  const auto after = scan.frames();
  scan.tidy();
  EXPECT_EQ(scan.frames(), steps == kSteps ? after : before);

  const auto report = verify_scan(scan.path(), {});
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_THAT(report->problems, IsEmpty());
  EXPECT_EQ(report->progress.done, steps == kSteps ? 2 : 1);

  // Once more changes nothing, and the rest of the job ends as if nothing had been.
  const auto tidied = scan.frames();
  scan.tidy();
  EXPECT_EQ(scan.frames(), tidied);
  const auto pending = Journal::open(journal_path(scan.path())).value().pending(0, 100).value();
  for (const PlanRow& row : pending) scan.take(row.row);
  const SmallScan undisturbed;
  undisturbed.take_all();
  EXPECT_EQ(scan.frames(), undisturbed.frames());
  for (const std::string& name : undisturbed.frames()) {
    if (fs::is_directory(undisturbed.path() / "frames" / name)) continue;
    EXPECT_EQ(test::bytes_in(scan.path() / "frames" / name),
              test::bytes_in(undisturbed.path() / "frames" / name));
  }
  EXPECT_TRUE(verify_scan(scan.path(), {}).value().complete());
}

INSTANTIATE_TEST_SUITE_P(AfterStep, Crash, ::testing::Range(0, 6));

TEST(CrashOfTidying, IsMendedByTheNext) {
  // Half removed already: what remains of a bracket is still removed.
  const SmallScan scan;
  scan.take(0);
  const auto before = scan.frames();
  scan.store_all(1);
  scan.publish(1);
  scan.store_all(2);
  fs::remove(scan.frame(1, 0));
  fs::remove(part_folder(scan.path(), 2) / frame_name(2));
  scan.tidy();
  EXPECT_EQ(scan.frames(), before);
}

TEST(CrashOfARetake, OfAPoseThatWasNeverCommittedLeavesNoneOfBoth) {
  // Published, not committed; taken again; killed between the exchange and the removal of the older take.
  const SmallScan scan;
  scan.store_all(1, 1);
  scan.publish(1);
  scan.store_all(1, 2);
  fs::rename(frames_folder(scan.path(), 1), scan.path() / "older");
  fs::rename(part_folder(scan.path(), 1), frames_folder(scan.path(), 1));
  fs::rename(scan.path() / "older", part_folder(scan.path(), 1));
  scan.tidy();
  EXPECT_THAT(scan.frames(), IsEmpty());
}

TEST(CrashOfARetake, BeforeItIsPublishedKeepsTheCommittedTake) {
  const SmallScan scan;
  scan.take(1);
  const auto before = scan.frames();
  scan.store_all(1, 2);
  scan.tidy();
  EXPECT_EQ(scan.frames(), before);
  EXPECT_EQ(read_frame(scan.frame(1, 0)).value().pixels, SmallScan::pixels(1, 0, 1));
  EXPECT_TRUE(verify_scan(scan.path(), {}).value().undamaged());
}

TEST(Tidy, RemovesWhatAnAbandonedPoseLeft) {
  const SmallScan scan;
  scan.take(0);
  const auto before = scan.frames();
  scan.store_all(1);
  scan.publish(1);
  {
    auto journal = Journal::open(journal_path(scan.path()));
    ASSERT_TRUE(journal.has_value());
    ASSERT_TRUE(journal->record_failure(1, "shaken", true, {}).has_value());
  }
  scan.tidy();
  EXPECT_EQ(scan.frames(), before);
}

TEST(Tidy, TouchesNothingOutsideTheFrames) {
  const SmallScan scan;
  test::put_bytes(scan.path() / "registration.json", "{}");
  scan.tidy();
  EXPECT_THAT(test::everything_in(scan.path()),
              UnorderedElementsAre("frames", "job.toml", "journal.sqlite", "registration.json", "rig.toml"));
}

TEST(Tidy, SaysThatTheFramesAreNotThere) {
  const SmallScan scan;
  fs::remove(scan.path() / "frames");
  const auto journal = Journal::open(journal_path(scan.path()));
  ASSERT_TRUE(journal.has_value());
  const auto done = tidy_scan(scan.path(), *journal);
  ASSERT_FALSE(done.has_value());
  EXPECT_THAT(done.error().where, HasSubstr("frames"));
}

}  // namespace
}  // namespace rig::scan
