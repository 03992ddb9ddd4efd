#include "daemon/state_db.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::daemon {
namespace {

JobEntry some_job(std::uint64_t id) {
  JobEntry job;
  job.id = id;
  job.name = "it's a \"job\"; DROP TABLE jobs";
  job.sample = "wool \xc3\xa9";
  job.scan_folder = "/scans/1";
  job.state = JobEntry::State::failed;
  job.poses = 300;
  job.done = 12;
  job.abandoned = 3;
  job.retries = 4;
  job.reason = "two\nlines";
  job.hold = "the carrier is dusty";
  job.needs_sample_change = true;
  return job;
}

TEST(StateDb, RemembersTheOrderOfTheQueue) {
  const test::TemporaryFolder folder;
  {
    auto db = StateDb::open(folder.path());
    ASSERT_TRUE(db.has_value()) << db.error().text();
    for (const std::uint64_t id : {1, 2, 3}) ASSERT_TRUE(db->save_job(some_job(id)).has_value());
    ASSERT_TRUE(db->save_order({3, 1, 2}).has_value());
    // What is saved later keeps its place, and what is new goes to the end.
    ASSERT_TRUE(db->save_job(some_job(3)).has_value());
    ASSERT_TRUE(db->save_job(some_job(4)).has_value());
  }
  auto db = StateDb::open(folder.path());
  ASSERT_TRUE(db.has_value()) << db.error().text();
  std::vector<std::uint64_t> order;
  const std::vector<JobEntry> jobs = db->jobs().value();
  for (const JobEntry& job : jobs) order.push_back(job.id);
  EXPECT_EQ(order, (std::vector<std::uint64_t>{3, 1, 2, 4}));
}

TEST(StateDb, RemembersEverything) {
  const test::TemporaryFolder folder;
  {
    auto db = StateDb::open(folder.path());
    ASSERT_TRUE(db.has_value()) << db.error().text();
    EXPECT_EQ(db->begin_epoch().value(), 1U);
    EXPECT_EQ(db->next_job_id().value(), 1U);
    EXPECT_EQ(db->stopped().value(), "");
    ASSERT_TRUE(db->save_job(some_job(1)).has_value());
    auto second = some_job(2);
    ASSERT_TRUE(db->save_job(second).has_value());
    second.state = JobEntry::State::active;
    ASSERT_TRUE(db->save_job(second).has_value());
    ASSERT_TRUE(db->save_stopped("somebody's coat").has_value());
  }
  auto db = StateDb::open(folder.path());
  ASSERT_TRUE(db.has_value()) << db.error().text();
  EXPECT_EQ(db->begin_epoch().value(), 2U);
  EXPECT_EQ(db->next_job_id().value(), 3U);
  EXPECT_EQ(db->stopped().value(), "somebody's coat");
  const auto jobs = db->jobs();
  ASSERT_TRUE(jobs.has_value());
  ASSERT_EQ(jobs->size(), 2U);
  const JobEntry& job = jobs->at(0);
  const JobEntry expected = some_job(1);
  EXPECT_EQ(job.id, 1U);
  EXPECT_EQ(job.name, expected.name);
  EXPECT_EQ(job.sample, expected.sample);
  EXPECT_EQ(job.scan_folder, expected.scan_folder);
  EXPECT_EQ(job.state, expected.state);
  EXPECT_EQ(job.poses, 300);
  EXPECT_EQ(job.done, 12);
  EXPECT_EQ(job.abandoned, 3);
  EXPECT_EQ(job.retries, 4);
  EXPECT_EQ(job.hold, expected.hold);
  EXPECT_TRUE(job.needs_sample_change);
  EXPECT_EQ(job.reason, expected.reason);
  EXPECT_EQ(jobs->at(1).state, JobEntry::State::active);
  ASSERT_TRUE(db->save_stopped("").has_value());
  EXPECT_EQ(db->stopped().value(), "");
}

TEST(StateDb, KnowsWhoseReportIsDue) {
  const test::TemporaryFolder folder;
  {
    auto db = StateDb::open(folder.path());
    ASSERT_TRUE(db.has_value()) << db.error().text();
    JobEntry job = some_job(1);
    for (const auto state : {JobEntry::State::active, JobEntry::State::aborted}) {
      EXPECT_TRUE(db->reports_due()->empty());
      job.state = state;
      ASSERT_TRUE(db->save_job(job).has_value());
    }
    ASSERT_TRUE(db->save_job(some_job(2)).has_value());  // failed
    // Of a complete one it is noted before it is saved as such.
    JobEntry third = some_job(3);
    third.state = JobEntry::State::active;
    ASSERT_TRUE(db->save_job(third).has_value());
    ASSERT_TRUE(db->note_report_due(3).has_value());
  }
  auto db = StateDb::open(folder.path());
  ASSERT_TRUE(db.has_value()) << db.error().text();
  EXPECT_EQ(db->reports_due().value(), (std::vector<std::uint64_t>{1, 2}));
  JobEntry third = some_job(3);
  third.state = JobEntry::State::complete;
  ASSERT_TRUE(db->save_job(third).has_value());
  EXPECT_EQ(db->reports_due().value(), (std::vector<std::uint64_t>{1, 2, 3}));
  ASSERT_TRUE(db->forget_report_due(2).has_value());
  ASSERT_TRUE(db->save_job(some_job(2)).has_value());  // as it was: nothing new is due
  EXPECT_EQ(db->reports_due().value(), (std::vector<std::uint64_t>{1, 3}));
}

TEST(StateDb, OpensWhatItsMakerLeftUnfinished) {
  const test::TemporaryFolder folder;
  test::put_bytes(folder / "state.sqlite", "");  // died between making the file and its tables
  auto db = StateDb::open(folder.path());
  ASSERT_TRUE(db.has_value()) << db.error().text();
  EXPECT_TRUE(db->save_job(some_job(1)).has_value());
}

TEST(StateDb, SaysThatAFileIsDamagedOrNone) {
  const test::TemporaryFolder folder;
  test::put_bytes(folder / "state.sqlite", std::string(5000, 'x'));
  EXPECT_FALSE(StateDb::open(folder.path()).has_value());
  EXPECT_FALSE(StateDb::open(folder / "nowhere").has_value());
}

// An error, or all of it.
TEST(StateDb, LosesNothingSilentlyFromATornFile) {
  const test::TemporaryFolder made;
  {
    auto db = StateDb::open(made.path());
    ASSERT_TRUE(db.has_value());
    for (std::uint64_t id = 1; id <= 40; ++id) ASSERT_TRUE(db->save_job(some_job(id)).has_value());
  }
  const std::string whole = test::bytes_in(made / "state.sqlite");
  ASSERT_GT(whole.size(), 8000U);
  base::Random random(test::seed(9));
  int errors = 0;
  for (int round = 0; round < 60; ++round) {
    const test::TemporaryFolder folder;
    const auto length = static_cast<std::size_t>(1 + random.below(whole.size() - 1));
    test::put_bytes(folder / "state.sqlite", whole.substr(0, length));
    const auto db = StateDb::open(folder.path());
    if (!db) {
      ++errors;
      EXPECT_FALSE(db.error().text().empty());
      continue;
    }
    // What was torn off was empty space.
    const auto jobs = db->jobs();
    ASSERT_TRUE(jobs.has_value());
    ASSERT_EQ(jobs->size(), 40U) << length << " of " << whole.size() << " bytes";
    for (const JobEntry& job : *jobs) EXPECT_EQ(job.reason, some_job(1).reason);
  }
  EXPECT_GT(errors, 30);
}

}  // namespace
}  // namespace rig::daemon
