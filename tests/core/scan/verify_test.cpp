// A scan that lacks a frame, has one too many, or differs in one bit from what was taken is not called whole.
#include "core/scan/verify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scan/scan_directory.h"
#include "tests/core/scan/small_scan.h"
#include "tests/core/seed.h"

namespace rig::scan {
namespace {

using namespace rig::scan::testing;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

VerifyReport verified(const SmallScan& scan) {
  const auto report = verify_scan(scan.path(), {});
  EXPECT_TRUE(report.has_value()) << report.error().text();
  return report.value_or(VerifyReport{});
}

TEST(Verify, FindsAWholeScanWhole) {
  const SmallScan scan;
  scan.take_all();
  std::vector<std::size_t> left;
  const auto report = verify_scan(scan.path(), [&left](std::size_t n) { left.push_back(n); });
  ASSERT_TRUE(report.has_value()) << report.error().text();
  EXPECT_THAT(report->problems, IsEmpty());
  EXPECT_TRUE(report->complete());
  EXPECT_EQ(report->progress.total, kPoses);
  EXPECT_EQ(report->progress.done, kPoses);
  EXPECT_EQ(report->frames_checked, static_cast<std::size_t>(kPoses * kFrames));
  std::uint64_t bytes = 0;
  for (int row = 0; row < kPoses; ++row)
    for (int index = 0; index < kFrames; ++index) bytes += fs::file_size(scan.frame(row, index));
  EXPECT_EQ(report->bytes_checked, bytes);
  EXPECT_THAT(left, ElementsAre(11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0));
}

TEST(Verify, TellsUnfinishedFromDamaged) {
  const SmallScan scan;
  scan.take(0);
  {
    auto journal = Journal::open(journal_path(scan.path()));
    ASSERT_TRUE(journal.has_value());
    ASSERT_TRUE(journal->record_failure(3, "shaken", true, {}).has_value());
  }
  const VerifyReport report = verified(scan);
  EXPECT_TRUE(report.undamaged());
  EXPECT_FALSE(report.complete());
  EXPECT_EQ(report.progress.done, 1);
  EXPECT_EQ(report.progress.abandoned, 1);
}

TEST(Verify, FindsAMissingFrame) {
  const SmallScan scan;
  scan.take_all();
  fs::remove(scan.frame(2, 1));
  const VerifyReport report = verified(scan);
  EXPECT_THAT(report.problems, ElementsAre(AllOf(HasSubstr("frames/000002/01.tif"), HasSubstr("missing"))));
  EXPECT_FALSE(report.complete());
}

TEST(Verify, FindsAMissingBracket) {
  const SmallScan scan;
  scan.take_all();
  fs::remove_all(frames_folder(scan.path(), 1));
  EXPECT_EQ(verified(scan).problems.size(), static_cast<std::size_t>(kFrames));
}

TEST(Verify, FindsFilesThatNobodyKnows) {
  const SmallScan scan;
  scan.take_all();
  fs::copy_file(scan.frame(2, 1), scan.frame(2, 7));
  test::put_bytes(scan.path() / "frames" / "notes.txt", "mine");
  scan.store(3, 0, 2);
  EXPECT_THAT(verified(scan).problems, ::testing::UnorderedElementsAre(
                                           HasSubstr("frames/000002/07.tif"), HasSubstr("frames/notes.txt"),
                                           HasSubstr("frames/000003.part/00.tif")));
}

TEST(Verify, FindsEveryFlippedBit) {
  const SmallScan scan;
  scan.take_all();
  std::mt19937_64 random(test::seed(9));
  const fs::path path = scan.frame(1, 2);
  const std::string whole = test::bytes_in(path);
  for (int i = 0; i < 100; ++i) {
    std::string bytes = whole;
    const std::size_t at = random() % bytes.size();
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random() % 8)));
    put_anew(path, bytes);
    ASSERT_THAT(verified(scan).problems,
                ElementsAre(AllOf(HasSubstr("frames/000001/02.tif"), HasSubstr("changed"))))
        << "byte " << at;
  }
  test::put_bytes(path, whole);
  EXPECT_TRUE(verified(scan).complete());
}

TEST(Verify, FindsACutFrame) {
  const SmallScan scan;
  scan.take_all();
  const std::string whole = test::bytes_in(scan.frame(0, 0));
  for (const std::size_t size : {std::size_t{0}, std::size_t{8}, whole.size() / 2, whole.size() - 1}) {
    test::put_bytes(scan.frame(0, 0), whole.substr(0, size));
    EXPECT_THAT(verified(scan).problems, ElementsAre(HasSubstr("frames/000000/00.tif"))) << size;
  }
  test::put_bytes(scan.frame(0, 0), whole + "x");
  EXPECT_THAT(verified(scan).problems, ElementsAre(HasSubstr("frames/000000/00.tif")));
}

TEST(Verify, FindsTwoFramesThatWereExchanged) {
  const SmallScan scan;
  scan.take_all();
  const std::string a = test::bytes_in(scan.frame(0, 0));
  test::put_bytes(scan.frame(0, 0), test::bytes_in(scan.frame(3, 2)));
  test::put_bytes(scan.frame(3, 2), a);
  EXPECT_EQ(verified(scan).problems.size(), 2U);
}

// The hash is right, and yet it is not that frame: somebody recorded the wrong one.
TEST(Verify, FindsAFrameThatSaysItIsAnother) {
  const SmallScan scan;
  PoseRecord pose = scan.store_all(0);
  scan.publish(0);
  fs::rename(scan.frame(0, 0), scan.path() / "first");
  fs::rename(scan.frame(0, 1), scan.frame(0, 0));
  fs::rename(scan.path() / "first", scan.frame(0, 1));
  std::swap(pose.frames[0].sha256, pose.frames[1].sha256);
  scan.commit(pose);
  EXPECT_THAT(verified(scan).problems,
              ElementsAre(AllOf(HasSubstr("frames/000000/00.tif"), HasSubstr("frame 1 of row 0")),
                          AllOf(HasSubstr("frames/000000/01.tif"), HasSubstr("frame 0 of row 0"))));
}

TEST(Verify, FindsAFileThatIsNoFrameThoughItsHashIsRight) {
  const SmallScan scan;
  PoseRecord pose = scan.store_all(0);
  test::put_bytes(part_folder(scan.path(), 0) / frame_name(1), "no TIFF");
  pose.frames[1].sha256 = base::sha256_of_file(part_folder(scan.path(), 0) / frame_name(1)).value();
  scan.publish(0);
  scan.commit(pose);
  EXPECT_THAT(verified(scan).problems, ElementsAre(AllOf(HasSubstr("000000/01.tif"), HasSubstr("TIFF"))));
}

TEST(Verify, FindsADonePoseWithoutFrames) {
  const SmallScan scan;
  scan.commit(some_pose(2, 0));
  EXPECT_THAT(verified(scan).problems, ElementsAre(HasSubstr("row 2")));
}

TEST(Verify, FindsAPlanThatIsNotThatOfTheJob) {
  const SmallScan scan;
  fs::remove(journal_path(scan.path()));
  { ASSERT_TRUE(Journal::create(journal_path(scan.path()), some_plan(kPoses + 1)).has_value()); }
  EXPECT_THAT(verified(scan).problems, ElementsAre(AllOf(HasSubstr("5"), HasSubstr("4"))));
}

TEST(Verify, SaysThatThereIsNoScan) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(verify_scan(folder.path(), {}).has_value());
  const SmallScan scan;
  fs::remove(scan.path() / "frames");
  EXPECT_THAT(verified(scan).problems, ElementsAre(HasSubstr("frames")));
}

}  // namespace
}  // namespace rig::scan
