#include "core/scan/journal.h"

#include <algorithm>

#include "core/scan/sqlite.h"

namespace rig::scan {

using base::pass;
using base::Result;
using machine::JointAngles;

namespace {

constexpr int kJournalVersion = 1;

constexpr const char* kSchema = R"sql(
CREATE TABLE rows(
  row INTEGER PRIMARY KEY, roll_rad REAL NOT NULL, tilt_rad REAL NOT NULL, pan_rad REAL NOT NULL, arm_rad REAL NOT NULL,
  state INTEGER NOT NULL DEFAULT 0, attempts INTEGER NOT NULL DEFAULT 0, reason TEXT NOT NULL DEFAULT '') STRICT;
CREATE TABLE poses(
  row INTEGER PRIMARY KEY REFERENCES rows(row), attempt INTEGER NOT NULL,
  roll_rad REAL NOT NULL, tilt_rad REAL NOT NULL, pan_rad REAL NOT NULL, arm_rad REAL NOT NULL,
  arrived_ns INTEGER NOT NULL, committed_ns INTEGER NOT NULL) STRICT;
CREATE TABLE frames(
  row INTEGER NOT NULL REFERENCES rows(row), idx INTEGER NOT NULL, file TEXT NOT NULL, exposure_s REAL NOT NULL,
  gain REAL NOT NULL, saturated_share REAL NOT NULL, started_ns INTEGER NOT NULL, sha256 TEXT NOT NULL,
  PRIMARY KEY(row, idx)) STRICT;
CREATE TABLE events(
  epoch INTEGER NOT NULL, number INTEGER NOT NULL, time_ns INTEGER NOT NULL, payload BLOB NOT NULL,
  PRIMARY KEY(epoch, number)) STRICT;
)sql";

// Came later: a journal without it is one of a scan without such poses.
constexpr const char* kShortfalls =
    "CREATE TABLE IF NOT EXISTS shortfalls(row INTEGER PRIMARY KEY REFERENCES rows(row), share REAL NOT "
    "NULL) "
    "STRICT;";

constexpr const char* kRowColumns = "row, roll_rad, tilt_rad, pan_rad, arm_rad, state, attempts, reason";

JointAngles angles_at(const Statement& s, int column) {
  return {s.number(column), s.number(column + 1), s.number(column + 2), s.number(column + 3)};
}

base::Time time_from(std::int64_t ns) {
  return base::Time(base::Duration(ns));
}
std::int64_t ns_of(base::Time time) {
  return time.time_since_epoch().count();
}

PlanRow plan_row_at(const Statement& s) {
  const auto state = std::clamp<std::int64_t>(s.integer(5), 0, 2);
  return {s.integer(0), angles_at(s, 1), static_cast<RowState>(state), static_cast<int>(s.integer(6)),
          s.text(7)};
}

constexpr const char* kSelectPoses =
    "SELECT p.row, p.attempt, r.roll_rad, r.tilt_rad, r.pan_rad, r.arm_rad, p.roll_rad, p.tilt_rad, "
    "p.pan_rad, "
    "p.arm_rad, p.arrived_ns, p.committed_ns FROM poses p JOIN rows r ON r.row = p.row WHERE r.state = 1";

PoseRecord pose_at(const Statement& s) {
  return {s.integer(0),
          static_cast<int>(s.integer(1)),
          angles_at(s, 2),
          angles_at(s, 6),
          time_from(s.integer(10)),
          time_from(s.integer(11)),
          {},
          std::nullopt};
}

Result<void> insert_events(const Database& database, const std::vector<EventRecord>& events) {
  if (events.empty()) return {};
  auto insert = database.prepare("INSERT OR REPLACE INTO events VALUES(?, ?, ?, ?)");
  if (!insert) return pass(insert);
  for (const EventRecord& e : events) {
    insert->bind(1, static_cast<std::int64_t>(e.epoch)).bind(2, static_cast<std::int64_t>(e.number));
    insert->bind(3, ns_of(e.time)).bind_blob(4, e.payload);
    if (auto done = insert->run(); !done) return done;
  }
  return {};
}

Result<std::vector<FrameRecord>> frames_of(const Database& database, std::int64_t row) {
  auto query = database.prepare(
      "SELECT idx, file, exposure_s, gain, saturated_share, started_ns, sha256 FROM frames WHERE row = ? "
      "ORDER BY idx");
  if (query) query->bind(1, row);
  std::vector<FrameRecord> frames;
  auto done = for_each(std::move(query), [&frames](const Statement& s) {
    frames.push_back({static_cast<int>(s.integer(0)), s.text(1), s.number(2), s.number(3), s.number(4),
                      time_from(s.integer(5)), s.text(6)});
  });
  if (!done) return pass(done);
  return frames;
}

// The shares that poses of an adaptive exposure have; poses are in row order.
Result<void> add_shortfalls(const Database& database, std::vector<PoseRecord>& poses) {
  auto table = database.prepare("SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = 'shortfalls'");
  if (!table) return pass(table);
  const auto exists = table->step();
  if (!exists) return pass(exists);
  if (!*exists) return {};
  auto query = database.prepare("SELECT row, share FROM shortfalls ORDER BY row");
  return for_each(std::move(query), [&poses](const Statement& s) {
    const auto found = std::lower_bound(poses.begin(), poses.end(), s.integer(0),
                                        [](const PoseRecord& p, std::int64_t row) { return p.row < row; });
    if (found != poses.end() && found->row == s.integer(0)) found->short_share = s.number(1);
  });
}

// Opens what should be a journal; where it is none or damaged, the error says how to go on.
Result<Database> open_database(const std::filesystem::path& path, Database::Mode mode) {
  const auto lost = [&path](std::string what) {
    return base::fail(
        base::ErrorCode::damaged, std::move(what), path.string(),
        "the frames are not touched by this; `rig scan recover` rebuilds the journal from them");
  };
  auto database = Database::open(path, mode, kJournalVersion);
  if (!database) {
    if (database.error().code == base::ErrorCode::damaged) return lost(database.error().what);
    return database;
  }
  // An empty file is a good database too.
  auto tables = database->prepare(
      "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name IN ('rows', 'poses', 'frames', "
      "'events')");
  if (!tables) return pass(tables);
  if (auto row = tables->step(); !row) return pass(row);
  constexpr std::int64_t kTables = 4;
  if (tables->integer(0) != kTables) return lost("is no journal of a scan: it lacks its tables");
  return database;
}

}  // namespace

struct Journal::State {
  Database database;
};

Journal::Journal(std::unique_ptr<State> state) : state_(std::move(state)) {}
Journal::Journal(Journal&&) noexcept = default;
Journal& Journal::operator=(Journal&&) noexcept = default;
Journal::~Journal() = default;

Result<Journal> Journal::create(const std::filesystem::path& path, const std::vector<JointAngles>& plan) {
  auto database = Database::open(path, Database::Mode::create, kJournalVersion);
  if (!database) return pass(database);
  auto state = std::make_unique<State>(State{std::move(*database)});
  const Database& db = state->database;
  auto done = db.transaction([&]() -> Result<void> {
    if (auto made = db.execute(kSchema); !made) return made;
    if (auto made = db.execute(kShortfalls); !made) return made;
    if (auto made = make_visit_tables(db); !made) return made;
    auto insert =
        db.prepare("INSERT INTO rows(row, roll_rad, tilt_rad, pan_rad, arm_rad) VALUES(?, ?, ?, ?, ?)");
    if (!insert) return pass(insert);
    for (std::size_t i = 0; i < plan.size(); ++i) {
      insert->bind(1, static_cast<std::int64_t>(i));
      for (std::size_t a = 0; a < machine::kAxisCount; ++a) insert->bind(static_cast<int>(a) + 2, plan[i][a]);
      if (auto ran = insert->run(); !ran) return ran;
    }
    return {};
  });
  if (!done) return pass(done);
  return Journal(std::move(state));
}

Result<Journal> Journal::open(const std::filesystem::path& path) {
  auto database = open_database(path, Database::Mode::write);
  if (!database) return pass(database);
  if (auto made = database->execute(kShortfalls); !made) return pass(made);
  if (auto made = make_visit_tables(*database); !made) return pass(made);
  return Journal(std::make_unique<State>(State{std::move(*database)}));
}

Result<Journal> Journal::open_read_only(const std::filesystem::path& path) {
  auto database = open_database(path, Database::Mode::read);
  if (!database) return pass(database);
  return Journal(std::make_unique<State>(State{std::move(*database)}));
}

Result<Journal> Journal::open_damaged(const std::filesystem::path& path) {
  auto database = Database::open_unchecked(path, kJournalVersion);
  if (!database) return pass(database);
  return Journal(std::make_unique<State>(State{std::move(*database)}));
}

Result<ScanProgress> Journal::progress() const {
  auto query = state_->database.prepare("SELECT count(*), sum(state = 1), sum(state = 2) FROM rows");
  ScanProgress progress;
  auto done = for_each(std::move(query), [&](const Statement& s) {
    progress = {s.integer(0), s.integer(1), s.integer(2)};
  });
  if (!done) return pass(done);
  return progress;
}

Result<std::vector<PlanRow>> Journal::plan() const {
  auto query = state_->database.prepare(fmt::format("SELECT {} FROM rows ORDER BY row", kRowColumns));
  std::vector<PlanRow> rows;
  auto done = for_each(std::move(query), [&](const Statement& s) { rows.push_back(plan_row_at(s)); });
  if (!done) return pass(done);
  return rows;
}

Result<std::optional<PlanRow>> Journal::plan_row(std::int64_t row) const {
  auto query = state_->database.prepare(fmt::format("SELECT {} FROM rows WHERE row = ?", kRowColumns));
  if (query) query->bind(1, row);
  std::optional<PlanRow> line;
  auto done = for_each(std::move(query), [&](const Statement& s) { line = plan_row_at(s); });
  if (!done) return pass(done);
  return line;
}

Result<std::vector<PlanRow>> Journal::pending(std::int64_t from, std::size_t limit) const {
  auto query = state_->database.prepare(
      fmt::format("SELECT {} FROM rows WHERE state = 0 AND row >= ? ORDER BY row LIMIT ?", kRowColumns));
  if (query) query->bind(1, from).bind(2, static_cast<std::int64_t>(limit));
  std::vector<PlanRow> rows;
  auto done = for_each(std::move(query), [&](const Statement& s) { rows.push_back(plan_row_at(s)); });
  if (!done) return pass(done);
  return rows;
}

Result<std::vector<PoseRecord>> Journal::poses() const {
  auto query = state_->database.prepare(fmt::format("{} ORDER BY p.row", kSelectPoses));
  std::vector<PoseRecord> poses;
  auto done = for_each(std::move(query), [&](const Statement& s) { poses.push_back(pose_at(s)); });
  if (!done) return pass(done);
  for (PoseRecord& pose : poses) {
    auto frames = frames_of(state_->database, pose.row);
    if (!frames) return pass(frames);
    pose.frames = std::move(*frames);
  }
  if (auto told = add_shortfalls(state_->database, poses); !told) return pass(told);
  return poses;
}

Result<std::optional<PoseRecord>> Journal::pose(std::int64_t row) const {
  auto query = state_->database.prepare(fmt::format("{} AND p.row = ?", kSelectPoses));
  if (query) query->bind(1, row);
  std::vector<PoseRecord> found;
  auto done = for_each(std::move(query), [&](const Statement& s) { found.push_back(pose_at(s)); });
  if (!done) return pass(done);
  if (found.empty()) return std::optional<PoseRecord>();
  auto frames = frames_of(state_->database, row);
  if (!frames) return pass(frames);
  found.front().frames = std::move(*frames);
  if (auto told = add_shortfalls(state_->database, found); !told) return pass(told);
  return std::optional<PoseRecord>(std::move(found.front()));
}

Result<void> Journal::copy_to(const std::filesystem::path& path) const {
  auto copy = state_->database.prepare("VACUUM INTO ?");
  if (!copy) return pass(copy);
  return copy->bind(1, std::string_view(path.string())).run();
}

Result<void> Journal::commit_pose(const PoseRecord& pose, const std::vector<EventRecord>& events) {
  const Database& db = state_->database;
  return db.transaction([&]() -> Result<void> {
    auto forget = db.prepare("DELETE FROM frames WHERE row = ?");
    if (!forget) return pass(forget);
    if (auto done = forget->bind(1, pose.row).run(); !done) return done;
    auto insert = db.prepare("INSERT OR REPLACE INTO poses VALUES(?, ?, ?, ?, ?, ?, ?, ?)");
    if (!insert) return pass(insert);
    insert->bind(1, pose.row).bind(2, static_cast<std::int64_t>(pose.attempt));
    for (std::size_t i = 0; i < machine::kAxisCount; ++i)
      insert->bind(static_cast<int>(i) + 3, pose.readback_rad[i]);
    insert->bind(7, ns_of(pose.arrived)).bind(8, ns_of(pose.committed));
    if (auto done = insert->run(); !done) return done;
    auto frame = db.prepare("INSERT INTO frames VALUES(?, ?, ?, ?, ?, ?, ?, ?)");
    if (!frame) return pass(frame);
    for (const FrameRecord& f : pose.frames) {
      frame->bind(1, pose.row).bind(2, static_cast<std::int64_t>(f.index)).bind(3, std::string_view(f.file));
      frame->bind(4, f.exposure_s).bind(5, f.gain).bind(6, f.saturated_share).bind(7, ns_of(f.started));
      frame->bind(8, std::string_view(f.sha256));
      if (auto done = frame->run(); !done) return done;
    }
    auto forget_share = db.prepare("DELETE FROM shortfalls WHERE row = ?");
    if (!forget_share) return pass(forget_share);
    if (auto done = forget_share->bind(1, pose.row).run(); !done) return done;
    if (pose.short_share) {
      auto share = db.prepare("INSERT INTO shortfalls VALUES(?, ?)");
      if (!share) return pass(share);
      if (auto done = share->bind(1, pose.row).bind(2, *pose.short_share).run(); !done) return done;
    }
    auto mark = db.prepare("UPDATE rows SET state = 1, reason = '' WHERE row = ?");
    if (!mark) return pass(mark);
    if (auto done = mark->bind(1, pose.row).run(); !done) return done;
    return insert_events(db, events);
  });
}

Result<void> Journal::record_failure(std::int64_t row, const std::string& reason, bool abandon,
                                     const std::vector<EventRecord>& events) {
  const Database& db = state_->database;
  return db.transaction([&]() -> Result<void> {
    auto mark = db.prepare("UPDATE rows SET attempts = attempts + 1, reason = ?, state = ? WHERE row = ?");
    if (!mark) return pass(mark);
    mark->bind(1, std::string_view(reason)).bind(2, std::int64_t{abandon ? 2 : 0}).bind(3, row);
    if (auto done = mark->run(); !done) return done;
    return insert_events(db, events);
  });
}

namespace {

// When the last good visit was; none: before everything.
Result<std::int64_t> last_good_ns(const Database& database) {
  auto query = database.prepare("SELECT coalesce(max(time_ns), 0) FROM visits WHERE good = 1");
  if (!query) return pass(query);
  if (auto row = query->step(); !row) return pass(row);
  return query->integer(0);
}

}  // namespace

Result<std::vector<std::int64_t>> Journal::record_visit(const VisitRecord& visit, Retake retake,
                                                        const std::vector<EventRecord>& events) {
  const Database& db = state_->database;
  std::vector<std::int64_t> again;
  auto done = db.transaction([&]() -> Result<void> {
    const auto good = last_good_ns(db);
    if (!good) return pass(good);
    if (auto inserted = insert_visit(db, visit); !inserted) return inserted;
    if (retake != Retake::none) {
      auto query = db.prepare("SELECT row FROM poses WHERE committed_ns > ? ORDER BY row");
      if (query) query->bind(1, retake == Retake::all ? std::int64_t{-1} : *good);
      auto read = for_each(std::move(query), [&](const Statement& s) { again.push_back(s.integer(0)); });
      if (!read) return read;
    }
    for (const std::int64_t row : again) {
      for (const char* sql : {"DELETE FROM shortfalls WHERE row = ?", "DELETE FROM frames WHERE row = ?",
                              "DELETE FROM poses WHERE row = ?", "UPDATE rows SET state = 0 WHERE row = ?"}) {
        auto change = db.prepare(sql);
        if (!change) return pass(change);
        if (auto changed = change->bind(1, row).run(); !changed) return changed;
      }
    }
    return insert_events(db, events);
  });
  if (!done) return pass(done);
  return again;
}

Result<std::vector<VisitRecord>> Journal::visits() const {
  return read_visits(state_->database);
}

Result<base::Time> Journal::latest() const {
  auto query = state_->database.prepare(
      "SELECT max((SELECT coalesce(max(committed_ns), 0) FROM poses), "
      "(SELECT coalesce(max(time_ns), 0) FROM visits))");
  if (!query) return pass(query);
  if (auto row = query->step(); !row) return pass(row);
  return time_from(query->integer(0));
}

Result<VisitsSoFar> Journal::visits_so_far() const {
  auto all = visits();
  if (!all) return pass(all);
  auto earliest = state_->database.prepare("SELECT min(committed_ns), count(*) FROM poses");
  if (!earliest) return pass(earliest);
  if (auto row = earliest->step(); !row) return pass(row);
  const bool any = earliest->integer(1) > 0;
  const base::Time begun = time_from(earliest->integer(0));
  VisitsSoFar so_far;
  for (const VisitRecord& visit : *all) {
    so_far.next = visit.number + 1;
    if (!visit.good) {
      so_far.since_good.push_back(visit);
      continue;
    }
    so_far.since_good.clear();
    if (!so_far.first || !any || visit.when < begun) {
      so_far.first = visit;
      so_far.agreed = 0;
    }
    ++so_far.agreed;
    so_far.last_good = std::max(so_far.last_good, visit.when);
  }
  auto query = state_->database.prepare("SELECT count(*) FROM poses WHERE committed_ns > ?");
  if (query) query->bind(1, ns_of(so_far.last_good));
  auto done = for_each(std::move(query), [&](const Statement& s) { so_far.poses_since_good = s.integer(0); });
  if (!done) return pass(done);
  return so_far;
}

Result<void> Journal::add_events(const std::vector<EventRecord>& events) {
  const Database& db = state_->database;
  return db.transaction([&] { return insert_events(db, events); });
}

Result<std::vector<EventRecord>> Journal::events_after(std::uint64_t epoch, std::uint64_t number,
                                                       std::size_t limit) const {
  auto query = state_->database.prepare(
      "SELECT epoch, number, time_ns, payload FROM events WHERE (epoch, number) > (?, ?) ORDER BY epoch, "
      "number LIMIT ?");
  if (query) {
    query->bind(1, static_cast<std::int64_t>(epoch)).bind(2, static_cast<std::int64_t>(number));
    query->bind(3, static_cast<std::int64_t>(limit));
  }
  std::vector<EventRecord> events;
  auto done = for_each(std::move(query), [&](const Statement& s) {
    events.push_back({static_cast<std::uint64_t>(s.integer(0)), static_cast<std::uint64_t>(s.integer(1)),
                      time_from(s.integer(2)), s.text(3)});
  });
  if (!done) return pass(done);
  return events;
}

}  // namespace rig::scan
