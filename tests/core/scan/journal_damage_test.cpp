// Journals whose writer died, whose file is torn, damaged, foreign or newer.
#include <csignal>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <sqlite3.h>

#include "core/scan/journal.h"
#include "tests/core/scan/some_frame.h"
#include "tests/core/seed.h"
#include "tests/core/temporary_folder.h"

namespace rig::scan {
namespace {

using base::ErrorCode;
using namespace rig::scan::testing;
using ::testing::HasSubstr;

constexpr int kRows = 30;

class JournalDamage : public ::testing::Test {
 protected:
  // A journal whose writer was killed after `commits` commits, so that its log is not folded into it.
  void make(int commits) const {
    const int status = test::in_child([&] {
      auto journal = Journal::create(path(), some_plan(kRows));
      for (int row = 0; row < commits && journal; ++row) {
        const auto number = static_cast<std::uint64_t>(row + 1);
        if (!journal->commit_pose(some_pose(row, 3), {some_event(1, number)})) return 1;
      }
      if (!journal) return 2;
      return ::raise(SIGKILL);
    });
    ASSERT_EQ(status, -1) << "not killed";
    ASSERT_GT(std::filesystem::file_size(log()), 0U);
  }

  // That what can be read of a journal is whole: so many rows done, each with all its frames and its event.
  static void expect_whole(const Journal& journal, std::int64_t done) {
    const auto poses = journal.poses();
    ASSERT_TRUE(poses.has_value()) << poses.error().text();
    ASSERT_EQ(static_cast<std::int64_t>(poses->size()), done);
    for (std::int64_t row = 0; row < done; ++row) {
      EXPECT_EQ(poses->at(static_cast<std::size_t>(row)).row, row);
      EXPECT_EQ(poses->at(static_cast<std::size_t>(row)).frames.size(), 3U);
    }
    EXPECT_EQ(static_cast<std::int64_t>(journal.events_after(0, 0, 1000).value().size()), done);
    EXPECT_EQ(static_cast<std::int64_t>(journal.pending(0, 1000).value().size()), kRows - done);
  }

  void expect_damaged(const std::string& said) const {
    for (const auto& opened : {&Journal::open, &Journal::open_read_only}) {
      const auto journal = opened(path());
      ASSERT_FALSE(journal.has_value()) << said;
      EXPECT_EQ(journal.error().code, ErrorCode::damaged) << journal.error().text();
      EXPECT_EQ(journal.error().where, path().string());
      EXPECT_THAT(journal.error().what, HasSubstr(said));
      EXPECT_THAT(journal.error().hint, HasSubstr("rig scan recover"));
    }
  }

  [[nodiscard]] std::filesystem::path path() const { return folder_ / "journal.sqlite"; }
  [[nodiscard]] std::filesystem::path log() const { return folder_ / "journal.sqlite-wal"; }
  // Readers of one log at once share what they know of it in a third file, which does not outlive them.
  void forget_shared_memory() const { std::filesystem::remove(folder_ / "journal.sqlite-shm"); }

  const test::TemporaryFolder folder_;
};

TEST_F(JournalDamage, WhatWasCommittedOutlivesItsWriter) {
  make(7);
  {
    auto reader = Journal::open_read_only(path());
    ASSERT_TRUE(reader.has_value()) << reader.error().text();
    expect_whole(*reader, 7);
  }
  auto journal = Journal::open(path());
  ASSERT_TRUE(journal.has_value()) << journal.error().text();
  expect_whole(*journal, 7);
  EXPECT_TRUE(journal->commit_pose(some_pose(7, 3), {some_event(1, 8)}).has_value());
  expect_whole(*journal, 8);
}

// A machine that stops may leave any beginning of the log: some last commits are gone then, none is there in
// part.
TEST_F(JournalDamage, ATornLogLosesWholeCommitsFromTheEnd) {
  make(12);
  const std::string database = test::bytes_in(path());
  const std::string whole = test::bytes_in(log());
  std::mt19937_64 random(test::seed(5));
  std::vector<std::size_t> cuts{0, 1, 31, 32, 33, whole.size() - 1, whole.size()};
  for (int i = 0; i < 60; ++i) cuts.push_back(random() % whole.size());
  std::sort(cuts.begin(), cuts.end());
  std::int64_t before = 0;
  std::size_t readable = 0;
  for (const std::size_t cut : cuts) {
    put_anew(path(), database);
    put_anew(log(), whole.substr(0, cut));
    forget_shared_memory();
    auto journal = Journal::open(path());
    if (!journal) {
      // So early that not even the plan is there.
      EXPECT_EQ(before, 0);
      EXPECT_EQ(journal.error().code, ErrorCode::damaged) << journal.error().text();
      continue;
    }
    ++readable;
    const std::int64_t done = journal->progress().value().done;
    EXPECT_GE(done, before) << "more of the log, fewer commits";
    before = done;
    expect_whole(*journal, done);
  }
  EXPECT_EQ(before, 12);
  EXPECT_GT(readable, 20U);
}

TEST_F(JournalDamage, AFlippedByteInTheLogEndsItThere) {
  make(12);
  const std::string database = test::bytes_in(path());
  const std::string whole = test::bytes_in(log());
  std::mt19937_64 random(test::seed(6));
  std::int64_t fewest = kRows;
  for (int i = 0; i < 40; ++i) {
    std::string bytes = whole;
    bytes[random() % bytes.size()] ^= 0x10;
    put_anew(path(), database);
    put_anew(log(), bytes);
    forget_shared_memory();
    auto journal = Journal::open(path());
    if (!journal) {
      EXPECT_EQ(journal.error().code, ErrorCode::damaged) << journal.error().text();
      continue;
    }
    const std::int64_t done = journal->progress().value().done;
    EXPECT_LE(done, 12);
    fewest = std::min(fewest, done);
    expect_whole(*journal, done);
  }
  EXPECT_LT(fewest, 12);
}

class FoldedJournal : public JournalDamage {
 protected:
  FoldedJournal() {
    auto journal = Journal::create(path(), some_plan(kRows));
    for (int row = 0; row < 12; ++row) {
      EXPECT_TRUE(
          journal->commit_pose(some_pose(row, 3), {some_event(1, static_cast<std::uint64_t>(row + 1))}));
    }
  }
};

TEST_F(FoldedJournal, CutShortIsDamaged) {
  const std::string whole = test::bytes_in(path());
  ASSERT_FALSE(std::filesystem::exists(log()));
  constexpr std::size_t kPage = 4096;
  for (const std::size_t size :
       {std::size_t{1}, std::size_t{50}, kPage / 2, kPage, 2 * kPage, whole.size() - kPage}) {
    test::put_bytes(path(), whole.substr(0, size));
    SCOPED_TRACE(size);
    expect_damaged("");
  }
}

TEST_F(FoldedJournal, WithARuinedPageIsDamaged) {
  const std::string whole = test::bytes_in(path());
  constexpr std::size_t kPage = 4096;
  ASSERT_GT(whole.size(), 4 * kPage);
  for (std::size_t page = 0; page < whole.size() / kPage; ++page) {
    std::string bytes = whole;
    bytes.replace(page * kPage, 200, std::string(200, '\xA5'));
    put_anew(path(), bytes);
    SCOPED_TRACE(page);
    expect_damaged("");
  }
}

TEST_F(FoldedJournal, NoFlippedBitDoesHarm) {
  const std::string whole = test::bytes_in(path());
  std::mt19937_64 random(test::seed(8));
  for (int i = 0; i < 400; ++i) {
    std::string bytes = whole;
    const std::size_t at = random() % bytes.size();
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random() % 8)));
    put_anew(path(), bytes);
    const auto journal = Journal::open_read_only(path());
    if (!journal) {
      EXPECT_EQ(journal.error().where, path().string());
      EXPECT_FALSE(journal.error().what.empty());
      continue;
    }
    // A bit of a number or a letter may pass; no reading may end the program.
    (void)journal->progress();
    (void)journal->plan();
    (void)journal->poses();
    (void)journal->events_after(0, 0, 100);
  }
}

TEST_F(JournalDamage, AFileThatIsNoneIsSaidToBeNone) {
  test::put_bytes(path(), "");
  expect_damaged("no journal");
  test::put_bytes(path(), std::string(5000, 'x'));
  expect_damaged("not a database");
  std::filesystem::remove(path());
  for (const auto& opened : {&Journal::open, &Journal::open_read_only}) {
    const auto journal = opened(path());
    ASSERT_FALSE(journal.has_value());
    EXPECT_EQ(journal.error().code, ErrorCode::not_found);
    EXPECT_FALSE(std::filesystem::exists(path())) << "opening made it";
  }
}

TEST_F(FoldedJournal, OfANewerVersionIsSaidToBeNewer) {
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(path().c_str(), &handle), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(handle, "PRAGMA user_version=2", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(handle);
  for (const auto& opened : {&Journal::open, &Journal::open_read_only}) {
    const auto journal = opened(path());
    ASSERT_FALSE(journal.has_value());
    EXPECT_EQ(journal.error().code, ErrorCode::newer);
    EXPECT_THAT(journal.error().text(), HasSubstr("version 2"));
  }
}

TEST_F(JournalDamage, AFullDiskFailsOneCommitAndHarmsNoOther) {
  { ASSERT_TRUE(Journal::create(path(), some_plan(kRows)).has_value()); }
  const auto most = static_cast<rlim_t>(std::filesystem::file_size(path()) + 40'000);
  const int committed = test::on_full_disk(most, [&] {
    auto journal = Journal::open(path());
    if (!journal) return 90;
    for (int row = 0; row < kRows; ++row) {
      const auto done =
          journal->commit_pose(some_pose(row, 3), {some_event(1, static_cast<std::uint64_t>(row + 1))});
      if (done) continue;
      // The reader's view at once: the failed one is not there in part.
      return journal->progress().value().done == row ? row : 91;
    }
    return 92;
  });
  ASSERT_GT(committed, 0);
  ASSERT_LT(committed, kRows);
  auto journal = Journal::open(path());
  ASSERT_TRUE(journal.has_value()) << journal.error().text();
  expect_whole(*journal, committed);
}

}  // namespace
}  // namespace rig::scan
