// The power goes at every moment of a job, and whatever the disk may hold then is opened as rigd opens it.
#include <gmock/gmock.h>

#include "core/base/files.h"
#include "core/scan/visits.h"
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

base::Time at_s(int s) {
  return base::Time(std::chrono::seconds(s));
}

base::Result<void> commit_at(const fs::path& scan, Journal& journal, std::int64_t row, int time_s) {
  auto pose = store_bracket(scan, row, 1);
  if (!pose) return base::pass(pose);
  pose->committed = at_s(time_s);
  if (auto ok = publish_bracket(scan, row); !ok) return ok;
  if (auto ok = journal.commit_pose(*pose, {}); !ok) return ok;
  return discard_bracket(scan, row);
}

// As rigd's storage does it.
base::Result<std::vector<std::int64_t>> visit_at(const fs::path& scan, Journal& journal, std::int64_t number,
                                                 int time_s, bool good) {
  VisitRecord visit;
  visit.number = number;
  visit.when = at_s(time_s);
  visit.good = good;
  visit.what = good ? "" : "the patches are dark";
  const auto pixels = SmallScan::pixels(100 + number, 0, 1);
  const auto hash = store_look(scan, number, "patches", some_facts(0, 0), kWidth, kHeight, pixels.data());
  if (!hash) return base::pass(hash);
  visit.looks = {{"patches",
                  fs::relative(visit_folder(scan, number) / "patches.tif", scan).string(),
                  0.1,
                  at_s(time_s - 1),
                  *hash,
                  {1000}}};
  if (auto ok = publish_visit(scan, number); !ok) return base::pass(ok);
  auto again = journal.record_visit(visit, good ? Retake::none : Retake::since_good,
                                    {some_event(1, static_cast<std::uint64_t>(100 + number))});
  if (!again) return base::pass(again);
  for (const std::int64_t row : *again) {
    if (auto ok = base::remove_tree(frames_folder(scan, row)); !ok) return base::pass(ok);
  }
  return again;
}

// A bad visit gives back the poses that nothing has proven: both or none of them, and those before it never.
TEST_F(PowerCut, WhileABadVisitGivesPosesBack) {
  base::Random random(test::seed(6));
  const fs::path root = folder_ / "disk";
  const fs::path scan = root / "scan";
  fs::create_directory(root);
  std::optional<Recorded> recorded;
  {
    const Recorded unused(root);
    ASSERT_TRUE(create_scan(scan, machine::shipped_rig_text(), job_text()).has_value());
    auto journal = Journal::open(journal_path(scan));
    ASSERT_TRUE(journal.has_value()) << journal.error().text();
    ASSERT_TRUE(commit_at(scan, *journal, 0, 100).has_value());
    ASSERT_TRUE(commit_at(scan, *journal, 1, 110).has_value());
    ASSERT_TRUE(visit_at(scan, *journal, 0, 120, true).has_value());
    ASSERT_TRUE(commit_at(scan, *journal, 2, 130).has_value());
    ASSERT_TRUE(commit_at(scan, *journal, 3, 140).has_value());
  }
  recorded.emplace(root);
  {
    auto journal = Journal::open(journal_path(scan));
    ASSERT_TRUE(journal.has_value()) << journal.error().text();
    const auto again = visit_at(scan, *journal, 1, 150, false);
    ASSERT_TRUE(again.has_value()) << again.error().text();
    ASSERT_THAT(*again, ::testing::ElementsAre(2, 3));
    recorded->log.note("given back");
    ASSERT_TRUE(commit_at(scan, *journal, 2, 160).has_value());
    recorded->log.note("taken again");
    ASSERT_TRUE(visit_at(scan, *journal, 2, 170, true).has_value());
    recorded->log.note("proven");
    ASSERT_TRUE(journal->add_events({some_event(1, 200)}).has_value());
    recorded->log.note("told");
  }
  for (std::size_t n = 0; n <= recorded->log.operations().size(); ++n) {
    const auto reached = notes_before(recorded->log, n);
    for (const Unflushed unflushed : kAll) {
      SCOPED_TRACE(fmt::format("after {} operations, the last: {}; unflushed {}", n,
                               n == 0 ? "none" : recorded->log.operations()[n - 1].text(),
                               static_cast<int>(unflushed)));
      const fs::path disk = restored(*recorded, n, unflushed, random);
      ASSERT_NO_FATAL_FAILURE(expect_recovered(disk / "scan", {"created", "committed 0", "committed 1"}));
      {
        const Recorded quiet(disk);
        const auto journal = Journal::open(journal_path(disk / "scan"));
        ASSERT_TRUE(journal.has_value()) << journal.error().text();
        const auto second = journal->pose(2);
        const auto third = journal->pose(3);
        const auto so_far = journal->visits_so_far();
        ASSERT_TRUE(second.has_value() && third.has_value() && so_far.has_value());
        const bool given_back = !*second || (*second)->committed == at_s(160);
        EXPECT_EQ(given_back, !*third) << "one without the other";
        EXPECT_EQ(given_back, so_far->next >= 2) << "with the visit";
        EXPECT_TRUE(given_back || reached.count("given back") == 0);
        EXPECT_TRUE(second->has_value() || reached.count("taken again") == 0);
        if (reached.count("proven") != 0) {
          EXPECT_EQ(so_far->next, 3);
          EXPECT_EQ(so_far->poses_since_good, 0);
        }
        const auto events = journal->events_after(0, 0, 100);
        ASSERT_TRUE(events.has_value());
        const bool told = std::any_of(events->begin(), events->end(),
                                      [](const EventRecord& event) { return event.number == 200; });
        EXPECT_TRUE(told || reached.count("told") == 0);
      }
      if (unflushed == Unflushed::dropped || unflushed == Unflushed::some) {
        ASSERT_NO_FATAL_FAILURE(expect_goes_on(disk / "scan", expected_));
      }
      if (HasFailure()) return;
      fs::remove_all(disk);
    }
  }
}

}  // namespace
}  // namespace rig::scan::testing
