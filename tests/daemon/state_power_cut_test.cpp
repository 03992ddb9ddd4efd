// The power goes at every moment of what rigd remembers for itself: what was answered is there, and what was
// being written is there whole or not at all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>

#include "daemon/state_db.h"
#include "tests/core/disk/recorded.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::daemon {
namespace {

namespace fs = std::filesystem;
using test::Recorded;
using test::Unflushed;

constexpr std::array kAll{Unflushed::dropped,      Unflushed::kept,          Unflushed::torn,
                          Unflushed::only_entries, Unflushed::only_contents, Unflushed::some};

// What is remembered, as one text.
std::string remembered(const StateDb& db) {
  const auto jobs = db.jobs();
  const auto stopped = db.stopped();
  const auto holder = db.lease_holder();
  EXPECT_TRUE(jobs.has_value() && stopped.has_value() && holder.has_value());
  if (!jobs || !stopped || !holder) return "nothing can be read";
  std::string text = "stopped '" + *stopped + "', lease '" + *holder + "'";
  for (const JobEntry& job : *jobs)
    text += fmt::format(", job {} in state {}, done {}, hold '{}'", job.id, static_cast<int>(job.state),
                        job.done, job.hold);
  return text;
}

JobEntry some_job(std::uint64_t id, JobEntry::State state, std::int64_t done) {
  JobEntry job;
  job.id = id;
  job.name = "job";
  job.scan_folder = "/scans/" + std::to_string(id);
  job.state = state;
  job.done = done;
  return job;
}

scan::EventRecord event(std::uint64_t number) {
  return {1, number, base::Time(base::Duration(number)), std::string(300, 'e')};
}

// What rigd writes in a night, each step answered when it is done.
std::vector<std::function<base::Result<void>(StateDb&)>> night() {
  using State = JobEntry::State;
  const auto save = [](JobEntry job) {
    return [job = std::move(job)](StateDb& db) { return db.save_job(job); };
  };
  const auto tell = [](std::uint64_t number) {
    return [number](StateDb& db) { return db.add_event(event(number)); };
  };
  JobEntry held = some_job(2, State::queued, 0);
  held.hold = "the carrier is dusty";
  return {
      [](StateDb& db) { return db.save_lease_holder("operator"); },
      save(some_job(1, State::queued, 0)),
      tell(1),
      save(some_job(2, State::queued, 0)),
      [](StateDb& db) {
        return db.save_order({2, 1});
      },
      save(held),
      save(some_job(1, State::active, 0)),
      tell(2),
      [](StateDb& db) { return db.save_stopped("a hand in the rig"); },
      tell(3),
      [](StateDb& db) { return db.save_stopped(""); },
      save(some_job(1, State::active, 7)),
      [](StateDb& db) -> base::Result<void> {
        if (auto trimmed = db.last_events(1); !trimmed) return base::pass(trimmed);
        return {};
      },
      [](StateDb& db) { return db.save_lease_holder(""); },
      save(some_job(1, State::complete, 9)),
  };
}

TEST(StateDbPowerCut, WhatWasAnsweredIsThere) {
  base::Random random(test::seed(12));
  const test::TemporaryFolder folder;
  const fs::path root = folder / "state";
  fs::create_directory(root);
  Recorded recorded(root);
  std::vector<std::string> states;  // after each step that was answered
  const auto answered = [&](const StateDb& db) {
    states.push_back(remembered(db));
    recorded.log.note("answered");
  };
  {
    auto db = StateDb::open(root);
    ASSERT_TRUE(db.has_value()) << db.error().text();
    ASSERT_EQ(db->begin_epoch().value(), 1U);
    answered(*db);
    for (const auto& step : night()) {
      const auto done = step(*db);
      ASSERT_TRUE(done.has_value()) << done.error().text();
      answered(*db);
    }
  }
  ASSERT_GT(recorded.log.operations().size(), 30U);
  int restored = 0;
  std::size_t answers = 0;
  for (std::size_t n = 0; n <= recorded.log.operations().size(); ++n) {
    if (n > 0 && recorded.log.operations()[n - 1].kind == test::Operation::Kind::note) ++answers;
    for (const Unflushed unflushed : kAll) {
      SCOPED_TRACE(fmt::format("after {} operations, the last: {}; {} answers; unflushed {}", n,
                               n == 0 ? "none" : recorded.log.operations()[n - 1].text(), answers,
                               static_cast<int>(unflushed)));
      const fs::path disk = folder / ("disk-" + std::to_string(++restored));
      recorded.image_after(n).restore(disk, unflushed, random);
      const Recorded quiet(disk);  // only so that nothing is flushed
      {
        auto db = StateDb::open(disk);
        ASSERT_TRUE(db.has_value()) << db.error().text();
        const std::string now = remembered(*db);
        const std::string before = answers == 0 ? states.front() : states.at(answers - 1);
        const std::string after = states.at(std::min(answers, states.size() - 1));
        EXPECT_TRUE(now == before || now == after) << now << "\nwhere it should be\n"
                                                   << before << "\nor\n"
                                                   << after;
        const auto epoch = db->begin_epoch();
        ASSERT_TRUE(epoch.has_value()) << epoch.error().text();
        EXPECT_TRUE(*epoch == 2 || (*epoch == 1 && answers == 0)) << *epoch << " is no new epoch";
        EXPECT_TRUE(db->last_events(100).has_value());
        const auto saved = db->save_job(some_job(3, JobEntry::State::queued, 0));
        EXPECT_TRUE(saved.has_value()) << saved.error().text();
      }
      if (::testing::Test::HasFailure()) return;
      fs::remove_all(disk);
    }
  }
}

}  // namespace
}  // namespace rig::daemon
