// The journal: what is pending in which order, what a commit or a failure changes, and that each is whole or
// not at all.
#include "core/scan/journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/core/scan/some_frame.h"
#include "tests/core/temporary_folder.h"

namespace rig::scan {
namespace {

using base::ErrorCode;
using namespace rig::scan::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

void expect_same(const PoseRecord& found, const PoseRecord& wanted) {
  EXPECT_EQ(found.row, wanted.row);
  EXPECT_EQ(found.attempt, wanted.attempt);
  EXPECT_EQ(found.target_rad, wanted.target_rad);
  EXPECT_EQ(found.readback_rad, wanted.readback_rad);
  EXPECT_EQ(found.arrived, wanted.arrived);
  EXPECT_EQ(found.committed, wanted.committed);
  ASSERT_EQ(found.frames.size(), wanted.frames.size());
  for (std::size_t i = 0; i < wanted.frames.size(); ++i) {
    EXPECT_EQ(found.frames[i].index, wanted.frames[i].index);
    EXPECT_EQ(found.frames[i].file, wanted.frames[i].file);
    EXPECT_EQ(found.frames[i].exposure_s, wanted.frames[i].exposure_s);
    EXPECT_EQ(found.frames[i].gain, wanted.frames[i].gain);
    EXPECT_EQ(found.frames[i].saturated_share, wanted.frames[i].saturated_share);
    EXPECT_EQ(found.frames[i].started, wanted.frames[i].started);
    EXPECT_EQ(found.frames[i].sha256, wanted.frames[i].sha256);
  }
}

std::vector<std::int64_t> numbers(const base::Result<std::vector<PlanRow>>& rows) {
  std::vector<std::int64_t> out;
  for (const PlanRow& row : rows.value()) out.push_back(row.row);
  return out;
}

using EventId = std::pair<std::uint64_t, std::uint64_t>;
std::vector<EventId> ids(const base::Result<std::vector<EventRecord>>& events) {
  std::vector<EventId> out;
  for (const EventRecord& event : events.value()) out.emplace_back(event.epoch, event.number);
  return out;
}

class JournalTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return folder_ / "journal.sqlite"; }
  void reopen() {
    journal_.reset();
    auto opened = Journal::open(path());
    ASSERT_TRUE(opened.has_value()) << opened.error().text();
    journal_.emplace(std::move(*opened));
  }
  [[nodiscard]] std::vector<std::int64_t> progress() const {
    const ScanProgress p = journal_->progress().value();
    return {p.total, p.done, p.abandoned};
  }

  const test::TemporaryFolder folder_;
  std::optional<Journal> journal_{std::move(Journal::create(path(), some_plan(6)).value())};
};

TEST_F(JournalTest, BeginsWithThePlanPendingInItsOrder) {
  EXPECT_THAT(progress(), ElementsAre(6, 0, 0));
  const auto plan = journal_->plan().value();
  ASSERT_EQ(plan.size(), 6U);
  for (std::size_t i = 0; i < plan.size(); ++i) {
    EXPECT_EQ(plan[i].row, static_cast<std::int64_t>(i));
    EXPECT_EQ(plan[i].target_rad, some_plan(6)[i]);
    EXPECT_EQ(plan[i].state, RowState::pending);
    EXPECT_EQ(plan[i].attempts, 0);
    EXPECT_EQ(plan[i].reason, "");
  }
  EXPECT_THAT(journal_->poses().value(), IsEmpty());
}

TEST_F(JournalTest, PendingRowsComeInOrderFromARowOnUpToANumber) {
  ASSERT_TRUE(journal_->commit_pose(some_pose(1, 1), {}).has_value());
  ASSERT_TRUE(journal_->record_failure(3, "out of reach", true, {}).has_value());
  ASSERT_TRUE(journal_->record_failure(4, "shaken", false, {}).has_value());
  EXPECT_THAT(numbers(journal_->pending(0, 100)), ElementsAre(0, 2, 4, 5));
  EXPECT_THAT(numbers(journal_->pending(0, 2)), ElementsAre(0, 2));
  EXPECT_THAT(numbers(journal_->pending(2, 2)), ElementsAre(2, 4));
  EXPECT_THAT(numbers(journal_->pending(3, 100)), ElementsAre(4, 5));
  EXPECT_THAT(numbers(journal_->pending(6, 100)), IsEmpty());
  EXPECT_THAT(numbers(journal_->pending(0, 0)), IsEmpty());
}

TEST_F(JournalTest, ACommittedPoseIsThereWithAllItsFrames) {
  ASSERT_TRUE(journal_->commit_pose(some_pose(4, 3), {}).has_value());
  ASSERT_TRUE(journal_->commit_pose(some_pose(2, 1), {}).has_value());
  reopen();
  EXPECT_THAT(progress(), ElementsAre(6, 2, 0));
  const auto poses = journal_->poses().value();
  ASSERT_EQ(poses.size(), 2U);
  expect_same(poses[0], some_pose(2, 1));
  expect_same(poses[1], some_pose(4, 3));
  expect_same(journal_->pose(4).value().value(), some_pose(4, 3));
  EXPECT_FALSE(journal_->pose(3).value().has_value());
  EXPECT_FALSE(journal_->pose(77).value().has_value());
}

TEST_F(JournalTest, KeepsTheShareOfPixelsThatFellShort) {
  PoseRecord adaptive = some_pose(1, 1);
  adaptive.short_share = 0.25;
  ASSERT_TRUE(journal_->commit_pose(adaptive, {}).has_value());
  ASSERT_TRUE(journal_->commit_pose(some_pose(2, 1), {}).has_value());
  reopen();
  auto poses = journal_->poses().value();
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].short_share, 0.25);
  EXPECT_FALSE(poses[1].short_share.has_value());
  // Taken again without: the old share is not that of the new bracket.
  ASSERT_TRUE(journal_->commit_pose(some_pose(1, 1), {}).has_value());
  EXPECT_FALSE(journal_->poses().value()[0].short_share.has_value());
}

TEST_F(JournalTest, OfAnOlderRigdHasNoSuchShares) {
  ASSERT_TRUE(journal_->commit_pose(some_pose(1, 1), {}).has_value());
  journal_.reset();
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open(path().c_str(), &raw), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(raw, "DROP TABLE shortfalls", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(raw);
  {
    const auto old = Journal::open_read_only(path());
    ASSERT_TRUE(old.has_value()) << old.error().text();
    EXPECT_EQ(old->poses().value().size(), 1U);
  }
  reopen();
  PoseRecord adaptive = some_pose(3, 1);
  adaptive.short_share = 0.5;
  EXPECT_TRUE(journal_->commit_pose(adaptive, {}).has_value()) << "an old scan may go on";
  EXPECT_EQ(journal_->poses().value().back().short_share, 0.5);
}

TEST_F(JournalTest, ACommitEndsTheReasonOfTheFailuresBeforeIt) {
  ASSERT_TRUE(journal_->record_failure(0, "shaken", false, {}).has_value());
  ASSERT_TRUE(journal_->record_failure(0, "shaken again", false, {}).has_value());
  const PlanRow failed = journal_->plan().value().at(0);
  EXPECT_EQ(failed.state, RowState::pending);
  EXPECT_EQ(failed.attempts, 2);
  EXPECT_EQ(failed.reason, "shaken again");

  ASSERT_TRUE(journal_->commit_pose(some_pose(0, 1), {}).has_value());
  const PlanRow done = journal_->plan().value().at(0);
  EXPECT_EQ(done.state, RowState::done);
  EXPECT_EQ(done.attempts, 2);
  EXPECT_EQ(done.reason, "");
}

TEST_F(JournalTest, AnAbandonedPoseKeepsItsReason) {
  ASSERT_TRUE(journal_->record_failure(5, "first", false, {}).has_value());
  ASSERT_TRUE(journal_->record_failure(5, "the axis 'pan' did not arrive", true, {}).has_value());
  reopen();
  const PlanRow row = journal_->plan().value().at(5);
  EXPECT_EQ(row.state, RowState::abandoned);
  EXPECT_EQ(row.attempts, 2);
  EXPECT_EQ(row.reason, "the axis 'pan' did not arrive");
  EXPECT_THAT(progress(), ElementsAre(6, 0, 1));
  EXPECT_THAT(journal_->poses().value(), IsEmpty());
}

TEST_F(JournalTest, ARetakeReplacesTheTakeWhole) {
  ASSERT_TRUE(journal_->commit_pose(some_pose(3, 4), {}).has_value());
  PoseRecord again = some_pose(3, 2);
  again.attempt = 7;
  again.frames[1].sha256 = std::string(64, 'f');
  ASSERT_TRUE(journal_->commit_pose(again, {}).has_value());
  expect_same(journal_->pose(3).value().value(), again);
  EXPECT_THAT(progress(), ElementsAre(6, 1, 0));
}

TEST_F(JournalTest, ACommitThatFailsLeavesNoTrace) {
  ASSERT_TRUE(journal_->commit_pose(some_pose(3, 2), {some_event(1, 1)}).has_value());

  PoseRecord twice = some_pose(3, 2);
  twice.attempt = 9;
  twice.frames[1].index = 0;
  EXPECT_FALSE(journal_->commit_pose(twice, {some_event(1, 2)}).has_value());
  EXPECT_FALSE(journal_->commit_pose(some_pose(6, 2), {some_event(1, 2)}).has_value())
      << "no row of the plan";

  reopen();
  expect_same(journal_->pose(3).value().value(), some_pose(3, 2));
  EXPECT_THAT(ids(journal_->events_after(0, 0, 100)), ElementsAre(EventId{1, 1}));
  EXPECT_THAT(progress(), ElementsAre(6, 1, 0));
  // And the next one is none the worse for it.
  EXPECT_TRUE(journal_->commit_pose(some_pose(4, 2), {}).has_value());
}

TEST_F(JournalTest, EventsComeAfterAPlaceInTheOrderOfEpochsAndNumbers) {
  ASSERT_TRUE(journal_->add_events({some_event(2, 1), some_event(1, 3)}).has_value());
  ASSERT_TRUE(journal_->commit_pose(some_pose(0, 1), {some_event(2, 2)}).has_value());
  ASSERT_TRUE(
      journal_->record_failure(1, "shaken", false, {some_event(2, 3), some_event(2, 10)}).has_value());
  ASSERT_TRUE(journal_->add_events({}).has_value());
  reopen();
  EXPECT_THAT(ids(journal_->events_after(0, 0, 100)),
              ElementsAre(EventId{1, 3}, EventId{2, 1}, EventId{2, 2}, EventId{2, 3}, EventId{2, 10}));
  EXPECT_THAT(ids(journal_->events_after(1, 3, 100)),
              ElementsAre(EventId{2, 1}, EventId{2, 2}, EventId{2, 3}, EventId{2, 10}));
  EXPECT_THAT(ids(journal_->events_after(2, 2, 1)), ElementsAre(EventId{2, 3}));
  EXPECT_THAT(ids(journal_->events_after(2, 10, 100)), IsEmpty());
  EXPECT_THAT(ids(journal_->events_after(3, 0, 100)), IsEmpty());
}

TEST_F(JournalTest, APayloadIsAnyBytes) {
  EventRecord event = some_event(1, 1);
  event.payload = std::string("\0\x01'\"; DROP TABLE rows;\xFF\0", 25);
  EventRecord empty = some_event(1, 2);
  empty.payload.clear();
  ASSERT_TRUE(journal_->add_events({event, empty}).has_value());
  const auto found = journal_->events_after(0, 0, 10).value();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].payload, event.payload);
  EXPECT_EQ(found[0].time, event.time);
  EXPECT_EQ(found[1].payload, "");
}

TEST_F(JournalTest, IsReadWhileItIsWritten) {
  auto reader = Journal::open_read_only(path());
  ASSERT_TRUE(reader.has_value()) << reader.error().text();
  ASSERT_TRUE(journal_->commit_pose(some_pose(0, 2), {}).has_value());
  EXPECT_EQ(reader->progress().value().done, 1);
  EXPECT_EQ(reader->poses().value().size(), 1U);
  const auto refused = reader->commit_pose(some_pose(1, 2), {});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().where, path().string());
  EXPECT_EQ(journal_->progress().value().done, 1);
}

TEST_F(JournalTest, IsMadeOnlyWhereNoneIs) {
  ASSERT_TRUE(journal_->commit_pose(some_pose(0, 2), {}).has_value());
  const auto second = Journal::create(path(), some_plan(2));
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, ErrorCode::refused);
  EXPECT_EQ(second.error().where, path().string());
  EXPECT_THAT(progress(), ElementsAre(6, 1, 0));
}

TEST_F(JournalTest, OfNoPosesIsAPlanToo) {
  const auto none = Journal::create(folder_ / "none.sqlite", {});
  ASSERT_TRUE(none.has_value()) << none.error().text();
  const ScanProgress p = none->progress().value();
  EXPECT_THAT((std::vector<std::int64_t>{p.total, p.done, p.abandoned}), ElementsAre(0, 0, 0));
  EXPECT_THAT(numbers(none->pending(0, 10)), IsEmpty());
}

}  // namespace
}  // namespace rig::scan
