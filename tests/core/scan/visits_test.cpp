// Reference visits in a scan: kept, read back, and what a bad one does to the poses before it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"
#include "core/scan/journal.h"
#include "core/scan/scan_directory.h"
#include "tests/core/temporary_folder.h"

namespace rig::scan {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

VisitRecord visit(std::int64_t number, int time_s, bool good) {
  VisitRecord record;
  record.number = number;
  record.when = base::Time(std::chrono::seconds(time_s));
  record.good = good;
  record.what = good ? "" : "the patches are dark";
  record.looks = {
      {"dark", "references/000000/dark.tif", 0.5, base::Time(std::chrono::seconds(time_s - 2)), "aa", {1.5}},
      {"patches",
       "references/000000/patches.tif",
       0.02,
       base::Time(std::chrono::seconds(time_s - 1)),
       "bb",
       {1000.25, 980.5}}};
  return record;
}

PoseRecord pose(std::int64_t row, int time_s) {
  PoseRecord record;
  record.row = row;
  record.committed = base::Time(std::chrono::seconds(time_s));
  record.frames = {{0, "frames/x/00.tif", 0.1, 1, 0, {}, "cc"}};
  record.short_share = 0.25;
  return record;
}

class Visits : public ::testing::Test {
 protected:
  Visits() {
    auto made = Journal::create(folder_ / "journal.sqlite", std::vector<machine::JointAngles>(4));
    EXPECT_TRUE(made.has_value());
    journal_.emplace(std::move(*made));
  }
  void commit(std::int64_t row, int time_s) {
    ASSERT_TRUE(journal_->commit_pose(pose(row, time_s), {}).has_value());
  }
  std::vector<std::int64_t> record(const VisitRecord& one) {
    auto again = journal_->record_visit(one, one.good ? Retake::none : Retake::since_good, {});
    EXPECT_TRUE(again.has_value());
    return again ? *again : std::vector<std::int64_t>{};
  }

  test::TemporaryFolder folder_;
  std::optional<Journal> journal_;
};

TEST_F(Visits, AreReadBackAsTheyWere) {
  record(visit(0, 100, true));
  record(visit(1, 200, false));
  const auto all = journal_->visits();
  ASSERT_TRUE(all.has_value());
  ASSERT_EQ(all->size(), 2U);
  EXPECT_TRUE((*all)[0].good);
  EXPECT_FALSE((*all)[1].good);
  EXPECT_EQ((*all)[1].what, "the patches are dark");
  ASSERT_EQ((*all)[0].looks.size(), 2U);
  const LookRecord& look = (*all)[0].looks[1];
  EXPECT_EQ(look.name, "patches");
  EXPECT_EQ(look.file, "references/000000/patches.tif");
  EXPECT_EQ(look.sha256, "bb");
  EXPECT_EQ(look.started, base::Time(std::chrono::seconds(99)));
  EXPECT_THAT(look.means_dn, ElementsAre(1000.25, 980.5));
}

TEST_F(Visits, ABadOneMakesThePosesSinceTheLastGoodOnePendingAgain) {
  record(visit(0, 100, true));
  commit(0, 110);
  record(visit(1, 120, true));
  commit(1, 130);
  commit(2, 140);
  EXPECT_THAT(record(visit(2, 150, false)), ElementsAre(1, 2));
  const auto progress = journal_->progress();
  ASSERT_TRUE(progress.has_value());
  EXPECT_EQ(progress->done, 1);
  const auto pending = journal_->pending(0, 10);
  ASSERT_TRUE(pending.has_value());
  ASSERT_EQ(pending->size(), 3U);
  EXPECT_EQ(pending->front().row, 1);
  EXPECT_EQ(journal_->poses()->size(), 1U);
  // Nothing was committed since: nothing more is taken again.
  EXPECT_THAT(record(visit(3, 160, false)), IsEmpty());
}

TEST_F(Visits, ThoseSoFarNameTheFirstGoodOneAndWhatIsNotProven) {
  EXPECT_EQ(journal_->visits_so_far()->next, 0);
  record(visit(0, 100, false));
  record(visit(1, 110, true));
  EXPECT_EQ(journal_->visits_so_far()->first->number, 1);
  commit(0, 120);
  record(visit(2, 130, true));
  commit(1, 140);
  const auto so_far = journal_->visits_so_far();
  ASSERT_TRUE(so_far.has_value());
  EXPECT_EQ(so_far->next, 3);
  ASSERT_TRUE(so_far->first.has_value());
  EXPECT_EQ(so_far->first->number, 1) << "the good one before the first pose";
  EXPECT_EQ(so_far->last_good, base::Time(std::chrono::seconds(130)));
  EXPECT_EQ(so_far->poses_since_good, 1);
  EXPECT_EQ(so_far->agreed, 2);
  EXPECT_THAT(so_far->since_good, IsEmpty());
}

TEST_F(Visits, ThoseSinceTheLastGoodOneAreToldInTheirOrder) {
  record(visit(0, 100, false));
  record(visit(1, 110, true));
  commit(0, 120);
  for (const int number : {2, 3}) record(visit(number, 110 + 10 * number, false));
  const auto so_far = journal_->visits_so_far();
  ASSERT_TRUE(so_far.has_value());
  ASSERT_EQ(so_far->since_good.size(), 2U);
  EXPECT_EQ(so_far->since_good[0].number, 2);
  EXPECT_EQ(so_far->since_good[1].number, 3);
}

// The rig could not go there before the first pose.
TEST_F(Visits, WherePosesCameBeforeTheFirstOneItIsTheStandardAllTheSame) {
  commit(0, 90);
  record(visit(0, 100, true));
  record(visit(1, 110, true));
  const auto so_far = journal_->visits_so_far();
  ASSERT_TRUE(so_far.has_value() && so_far->first.has_value());
  EXPECT_EQ(so_far->first->number, 0);
  EXPECT_EQ(so_far->agreed, 2);
}

// Whatever was proven in the old light.
TEST_F(Visits, ANewStandardMakesEveryPosePendingAgain) {
  record(visit(0, 100, true));
  commit(0, 110);
  record(visit(1, 120, true));
  commit(1, 130);
  const auto again = journal_->record_visit(visit(2, 140, true), Retake::all, {});
  ASSERT_TRUE(again.has_value());
  EXPECT_THAT(*again, ElementsAre(0, 1));
  EXPECT_EQ(journal_->progress()->done, 0);
  commit(0, 150);
  EXPECT_EQ(journal_->visits_so_far()->first->number, 2);
}

TEST_F(Visits, FramesThatTheJournalDoesNotKnowAreTidiedAway) {
  const auto scan = folder_.path();
  std::filesystem::create_directories(scan / "frames");
  const std::vector<std::uint16_t> pixels(12, 7);
  for (const std::int64_t number : {0, 1}) {
    ASSERT_TRUE(store_look(scan, number, "dark", {}, 4, 3, pixels.data()).has_value());
    ASSERT_TRUE(publish_visit(scan, number).has_value());
  }
  ASSERT_TRUE(store_look(scan, 2, "dark", {}, 4, 3, pixels.data()).has_value());
  record(visit(0, 100, true));
  ASSERT_TRUE(tidy_scan(scan, *journal_).has_value());
  EXPECT_TRUE(std::filesystem::exists(visit_folder(scan, 0) / "dark.tif"));
  EXPECT_FALSE(std::filesystem::exists(visit_folder(scan, 1)));
  EXPECT_FALSE(std::filesystem::exists(visit_part_folder(scan, 2)));
}

}  // namespace
}  // namespace rig::scan
