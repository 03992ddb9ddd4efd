// A journal rebuilt from the frames.
#include "core/scan/recover.h"

#include <gmock/gmock.h>

#include "core/scan/verify.h"
#include "core/scan/visits.h"
#include "tests/core/scan/recorded_job.h"

namespace rig::scan::testing {
namespace {

using base::ErrorCode;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Recover : public ::testing::Test {
 protected:
  Recover() {
    test::OperationLog unused(scan_.path());
    const auto done = run_job(scan_.path(), unused);
    EXPECT_TRUE(done.has_value()) << done.error().text();
  }

  [[nodiscard]] RecoverReport recovered(bool even_if_whole = false) const {
    RecoverOptions options;
    options.even_if_whole = even_if_whole;
    auto report = recover_journal(scan_.path(), options);
    EXPECT_TRUE(report.has_value()) << report.error().text();
    return report.value_or(RecoverReport{});
  }
  [[nodiscard]] fs::path journal() const { return journal_path(scan_.path()); }

  const SmallScan scan_;
};

TEST_F(Recover, ALostJournal) {
  const auto before = Journal::open_read_only(journal()).value().poses().value();
  const auto frames = frames_below(scan_.path());
  fs::remove(journal());
  const RecoverReport report = recovered();
  EXPECT_THAT(report.kept.string(), IsEmpty());
  ASSERT_EQ(report.rows.size(), static_cast<std::size_t>(kPoses));
  for (const RecoveredRow& row : report.rows) {
    EXPECT_EQ(row.state, RowState::done) << row.reason;
    EXPECT_EQ(row.frames, kFrames);
    EXPECT_FALSE(row.proven) << "nothing is left that could prove it";
  }
  EXPECT_TRUE(verify_scan(scan_.path(), {}).value().complete());
  EXPECT_TRUE(frames_below(scan_.path()) == frames) << "no frame is touched";
  const auto after = Journal::open_read_only(journal()).value().poses().value();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_EQ(after[i].target_rad, before[i].target_rad);
    for (std::size_t f = 0; f < before[i].frames.size(); ++f) {
      EXPECT_EQ(after[i].frames[f].sha256, before[i].frames[f].sha256);
      EXPECT_EQ(after[i].frames[f].file, before[i].frames[f].file);
      EXPECT_DOUBLE_EQ(after[i].frames[f].exposure_s, before[i].frames[f].exposure_s);
      EXPECT_DOUBLE_EQ(after[i].frames[f].gain, 1.5);
    }
    for (std::size_t axis = 0; axis < machine::kAxisCount; ++axis) {
      EXPECT_NEAR(after[i].readback_rad[axis], some_facts(0, 0).readback_rad[axis], 1e-12);
    }
  }
}

TEST_F(Recover, ADamagedJournalGivesWhatCanStillBeRead) {
  std::string bytes = test::bytes_in(journal());
  constexpr std::size_t kPage = 4096;
  ASSERT_GT(bytes.size(), 3 * kPage);
  int hurt = 0;
  int proven = 0;
  // Every page in turn, so that whichever table it belongs to, the scan is whole again.
  for (std::size_t page = 0; page * kPage < bytes.size(); ++page) {
    SCOPED_TRACE(page);
    std::string damaged = bytes;
    damaged.replace(page * kPage, kPage, kPage, '\x5a');
    test::put_bytes(journal(), damaged);
    const auto opened = Journal::open(journal());
    if (opened) continue;  // a page that holds nothing
    EXPECT_THAT(opened.error().text(), HasSubstr("rig scan recover"));
    const RecoverReport report = recovered();
    EXPECT_TRUE(test::bytes_in(report.kept) == damaged) << "the old file is kept as it was";
    for (const RecoveredRow& row : report.rows) EXPECT_EQ(row.state, RowState::done) << row.reason;
    EXPECT_TRUE(verify_scan(scan_.path(), {}).value().complete());
    ++hurt;
    const auto is_proven = [](const RecoveredRow& row) { return row.proven; };
    if (std::all_of(report.rows.begin(), report.rows.end(), is_proven)) ++proven;
    fs::remove(report.kept);
  }
  EXPECT_GE(hurt, 3);
  EXPECT_GE(proven, 1) << "a page that is not of the frames' table costs no proof";
}

TEST_F(Recover, KeepsTimesAttemptsEventsAndAbandonedRows) {
  {
    auto journal = Journal::open(this->journal()).value();
    ASSERT_TRUE(journal.record_failure(3, "cable in the way", true, {}).has_value());
  }
  fs::remove_all(frames_folder(scan_.path(), 3));
  const auto poses = Journal::open_read_only(journal()).value().poses().value();
  const auto events = Journal::open_read_only(journal()).value().events_after(0, 0, 100).value();
  ASSERT_FALSE(events.empty());
  const RecoverReport report = recovered(true);
  EXPECT_EQ(report.rows[3].state, RowState::abandoned);
  EXPECT_EQ(report.rows[3].reason, "cable in the way");
  for (int row = 0; row < 3; ++row) EXPECT_TRUE(report.rows[static_cast<std::size_t>(row)].proven);
  const auto after = Journal::open_read_only(journal()).value();
  const auto recovered_poses = after.poses().value();
  ASSERT_EQ(recovered_poses.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(recovered_poses[i].arrived, poses[i].arrived);
    EXPECT_EQ(recovered_poses[i].committed, poses[i].committed);
    EXPECT_EQ(recovered_poses[i].attempt, poses[i].attempt);
  }
  EXPECT_EQ(after.plan().value()[kFailingRow].attempts, 1);
  EXPECT_EQ(after.events_after(0, 0, 100).value().size(), events.size());
  EXPECT_TRUE(fs::exists(report.kept));
}

// A visit as rigd takes one: its frames in their folder, then the journal.
VisitRecord take_visit(const fs::path& scan, std::int64_t number, bool good) {
  VisitRecord visit;
  visit.number = number;
  visit.when = base::Time(std::chrono::seconds(1000 + number));
  visit.good = good;
  visit.what = good ? "" : "the room is not dark";
  for (const char* name : {"dark", "patches"}) {
    FrameFacts facts = planned_facts(0, 0);
    facts.exposure_s = 0.25;
    const auto hash =
        store_look(scan, number, name, facts, kWidth, kHeight, SmallScan::pixels(number, 0, 3).data());
    EXPECT_TRUE(hash.has_value());
    const std::string file = fs::relative(visit_folder(scan, number) / name, scan).string() + ".tif";
    visit.looks.push_back({name, file, 0.25, visit.when, hash.value_or(""), {1.5, 2.5}});
  }
  EXPECT_TRUE(publish_visit(scan, number).has_value());
  auto journal = Journal::open(journal_path(scan));
  EXPECT_TRUE(journal && journal->record_visit(visit, Retake::none, {}));
  return visit;
}

TEST_F(Recover, KeepsReferenceVisitsWhoseVerdictCanBeRead) {
  const VisitRecord taken = take_visit(scan_.path(), 0, true);
  (void)take_visit(scan_.path(), 1, false);
  const RecoverReport report = recovered(true);
  ASSERT_EQ(report.visits.size(), 2U);
  for (const RecoveredVisit& visit : report.visits) {
    EXPECT_TRUE(visit.judged);
    EXPECT_EQ(visit.frames, 2);
    EXPECT_EQ(visit.reason, "");
  }
  const auto visits = Journal::open_read_only(journal()).value().visits().value();
  ASSERT_EQ(visits.size(), 2U);
  EXPECT_TRUE(visits[0].good);
  EXPECT_EQ(visits[0].when, taken.when);
  EXPECT_EQ(visits[0].looks[1].means_dn, taken.looks[1].means_dn);
  EXPECT_EQ(visits[1].what, "the room is not dark");
}

TEST_F(Recover, AVisitWithoutVerdictKeepsItsFramesAndCountsForNothing) {
  const VisitRecord taken = take_visit(scan_.path(), 4, true);
  fs::remove(journal());
  const RecoverReport report = recovered();
  ASSERT_EQ(report.visits.size(), 1U);
  EXPECT_EQ(report.visits[0].number, 4);
  EXPECT_FALSE(report.visits[0].judged);
  auto journal_again = Journal::open(journal()).value();
  const auto visits = journal_again.visits().value();
  ASSERT_EQ(visits.size(), 1U);
  EXPECT_FALSE(visits[0].good);
  EXPECT_THAT(visits[0].what, HasSubstr("lost with the journal"));
  ASSERT_EQ(visits[0].looks.size(), 2U);
  EXPECT_EQ(visits[0].looks[0].name, "dark");
  EXPECT_EQ(visits[0].looks[0].sha256, taken.looks[0].sha256);
  EXPECT_EQ(visits[0].looks[0].file, taken.looks[0].file);
  EXPECT_DOUBLE_EQ(visits[0].looks[0].exposure_s, 0.25);
  EXPECT_EQ(journal_again.visits_so_far().value().next, 5);
  EXPECT_FALSE(journal_again.visits_so_far().value().first.has_value());
  // The job that goes on tidies its folder: what the journal knows stays.
  ASSERT_TRUE(tidy_scan(scan_.path(), journal_again).has_value());
  EXPECT_TRUE(fs::exists(scan_.path() / taken.looks[1].file));
  EXPECT_TRUE(verify_scan(scan_.path(), {}).value().complete());
}

TEST_F(Recover, AVisitWhoseFrameChangedIsNotKept) {
  const VisitRecord taken = take_visit(scan_.path(), 0, true);
  const fs::path file = scan_.path() / taken.looks[0].file;
  std::string bytes = test::bytes_in(file);
  bytes[bytes.size() / 2] = static_cast<char>(~bytes[bytes.size() / 2]);
  test::put_bytes(file, bytes);
  const RecoverReport report = recovered(true);
  ASSERT_EQ(report.visits.size(), 1U);
  EXPECT_THAT(report.visits[0].reason, HasSubstr("changed since it was taken"));
  EXPECT_TRUE(Journal::open_read_only(journal()).value().visits().value().empty());
}

TEST_F(Recover, WhatIsNotWholeIsPendingAndSaysWhy) {
  fs::remove(scan_.frame(0, 2));
  std::string cut = test::bytes_in(scan_.frame(1, 0));
  cut.resize(cut.size() / 2);
  test::put_bytes(scan_.frame(1, 0), cut);
  fs::rename(frames_folder(scan_.path(), 2), part_folder(scan_.path(), 2));
  fs::remove_all(frames_folder(scan_.path(), 3));
  fs::copy(frames_folder(scan_.path(), 0), frames_folder(scan_.path(), 3));
  const auto frames = frames_below(scan_.path());
  fs::remove(journal());
  const RecoverReport report = recovered();
  for (const RecoveredRow& row : report.rows) EXPECT_EQ(row.state, RowState::pending) << row.row;
  EXPECT_THAT(report.rows[0].reason, HasSubstr("2 of 3 frames"));
  EXPECT_THAT(report.rows[1].reason, HasSubstr("frames/000001/00.tif"));
  EXPECT_THAT(report.rows[2].reason, HasSubstr("never complete"));
  EXPECT_THAT(report.rows[3].reason, HasSubstr("row 0"));
  EXPECT_TRUE(frames_below(scan_.path()) == frames);
  // rigd goes on with such a journal.
  test::OperationLog unused(scan_.path());
  ASSERT_TRUE(run_job(scan_.path(), unused).has_value());
  EXPECT_TRUE(verify_scan(scan_.path(), {}).value().complete());
}

TEST_F(Recover, PixelsThatChangedAreSeenWhereTheOldJournalStillHasTheirHash) {
  std::string bytes = test::bytes_in(scan_.frame(1, 1));
  ASSERT_GT(bytes.size(), 20U);
  bytes[16] = static_cast<char>(bytes[16] ^ 1);
  test::put_bytes(scan_.frame(1, 1), bytes);
  const RecoverReport report = recovered(true);
  EXPECT_EQ(report.rows[1].state, RowState::pending);
  EXPECT_THAT(report.rows[1].reason, HasSubstr("changed since"));
  EXPECT_TRUE(report.rows[0].proven);
}

TEST_F(Recover, AWholeJournalIsLeftAlone) {
  const std::string bytes = test::bytes_in(journal());
  const auto refused = recover_journal(scan_.path(), {});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::refused);
  EXPECT_TRUE(test::bytes_in(journal()) == bytes);
}

TEST_F(Recover, AJournalInUseIsLeftAlone) {
  const auto in_use = Journal::open(journal());
  ASSERT_TRUE(in_use.has_value());
  RecoverOptions options;
  options.even_if_whole = true;
  // By another process, as rigd is one.
  EXPECT_EQ(test::in_child([&] {
              const auto refused = recover_journal(scan_.path(), options);
              return !refused && refused.error().code == ErrorCode::busy ? 7 : 1;
            }),
            7);
}

// The retake lies in the place of the take that the journal knows.
TEST_F(Recover, ARetakeThatWasNotCommittedDoesNotCostThePose) {
  ASSERT_TRUE(store_bracket(scan_.path(), 2, 9).has_value());
  ASSERT_TRUE(publish_bracket(scan_.path(), 2).has_value());
  const RecoverReport report = recovered(true);
  EXPECT_EQ(report.rows[2].state, RowState::done);
  EXPECT_TRUE(report.rows[2].proven);
  scan_.tidy();
  EXPECT_TRUE(verify_scan(scan_.path(), {}).value().complete());
}

// The power goes at every moment of it: the journal is the old or the new, and recovering again goes through.
TEST_F(Recover, IsSafeAtEveryMoment) {
  test::put_bytes(journal(), "no journal");
  const auto frames = frames_below(scan_.path());
  const test::TemporaryFolder folder;
  test::Recorded recorded(scan_.path());
  ASSERT_TRUE(recover_journal(scan_.path(), {}).has_value());
  base::Random random(1);
  for (std::size_t n = 0; n <= recorded.log.operations().size(); n += 1) {
    for (const auto unflushed : {test::Unflushed::dropped, test::Unflushed::kept, test::Unflushed::some}) {
      SCOPED_TRACE(fmt::format("after {} operations, unflushed {}", n, static_cast<int>(unflushed)));
      const fs::path disk = folder / "disk";
      recorded.image_after(n).restore(disk, unflushed, random);
      if (!Journal::open(journal_path(disk))) {
        const auto again = recover_journal(disk, {});
        ASSERT_TRUE(again.has_value()) << again.error().text();
      }
      EXPECT_TRUE(verify_scan(disk, {}).value().complete());
      EXPECT_TRUE(frames_below(disk) == frames);
      fs::remove_all(disk);
    }
  }
}

}  // namespace
}  // namespace rig::scan::testing
