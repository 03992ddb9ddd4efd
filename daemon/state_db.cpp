#include "daemon/state_db.h"

#include <algorithm>

namespace rig::daemon {

using base::pass;
using base::Result;
using scan::Database;

namespace {

constexpr int kStateVersion = 1;
constexpr const char* kSchema = R"sql(
CREATE TABLE IF NOT EXISTS jobs(id INTEGER PRIMARY KEY, name TEXT NOT NULL, sample TEXT NOT NULL, scan_folder TEXT NOT NULL,
  state INTEGER NOT NULL, poses INTEGER NOT NULL, done INTEGER NOT NULL, abandoned INTEGER NOT NULL,
  retries INTEGER NOT NULL, reason TEXT NOT NULL) STRICT;
CREATE TABLE IF NOT EXISTS queue(job INTEGER PRIMARY KEY, place INTEGER NOT NULL, hold TEXT NOT NULL,
  needs_sample_change INTEGER NOT NULL) STRICT;
CREATE TABLE IF NOT EXISTS reports_due(job INTEGER PRIMARY KEY) STRICT;
CREATE TABLE IF NOT EXISTS events(epoch INTEGER NOT NULL, number INTEGER NOT NULL, time_ns INTEGER NOT NULL,
  payload BLOB NOT NULL, PRIMARY KEY(epoch, number)) STRICT;
CREATE TABLE IF NOT EXISTS facts(key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
)sql";

}  // namespace

Result<base::FolderLock> take_state_folder(const std::filesystem::path& folder) {
  return base::FolderLock::take(
      folder, "lock", {"another rigd uses this state folder", "stop it, or choose another --state"});
}

Result<StateDb> StateDb::open(const std::filesystem::path& folder) {
  const auto path = folder / "state.sqlite";
  const bool exists = std::filesystem::exists(path);
  auto database =
      Database::open(path, exists ? Database::Mode::write : Database::Mode::create, kStateVersion);
  if (!database) return pass(database);
  // Also where the file exists: its maker may have died before the tables were there.
  auto made = database->transaction([&] { return database->execute(kSchema); });
  if (!made) return pass(made);
  return StateDb(folder, std::move(*database));
}

Result<std::uint64_t> StateDb::begin_epoch() {
  auto read = database_.prepare("SELECT value FROM facts WHERE key = 'epoch'");
  if (!read) return pass(read);
  auto row = read->step();
  if (!row) return pass(row);
  const std::int64_t epoch = (*row ? read->integer(0) : 0) + 1;
  auto write = database_.prepare("INSERT OR REPLACE INTO facts VALUES('epoch', ?)");
  if (!write) return pass(write);
  if (auto done = write->bind(1, std::string_view(std::to_string(epoch))).run(); !done) return pass(done);
  return static_cast<std::uint64_t>(epoch);
}

Result<std::vector<JobEntry>> StateDb::jobs() const {
  auto query = database_.prepare(
      "SELECT id, name, sample, scan_folder, state, poses, done, abandoned, retries, reason, "
      "coalesce(hold, ''), coalesce(needs_sample_change, 0) FROM jobs LEFT JOIN queue ON job = id "
      "ORDER BY coalesce(place, id), id");
  if (!query) return pass(query);
  std::vector<JobEntry> jobs;
  while (true) {
    auto row = query->step();
    if (!row) return pass(row);
    if (!*row) return jobs;
    JobEntry job;
    job.id = static_cast<std::uint64_t>(query->integer(0));
    job.name = query->text(1);
    job.sample = query->text(2);
    job.scan_folder = query->text(3);
    job.state = static_cast<JobEntry::State>(std::clamp<std::int64_t>(query->integer(4), 0, 4));
    job.poses = query->integer(5);
    job.done = query->integer(6);
    job.abandoned = query->integer(7);
    job.retries = query->integer(8);
    job.reason = query->text(9);
    job.hold = query->text(10);
    job.needs_sample_change = query->integer(11) != 0;
    jobs.push_back(std::move(job));
  }
}

Result<std::uint64_t> StateDb::next_job_id() const {
  auto query = database_.prepare("SELECT coalesce(max(id), 0) + 1 FROM jobs");
  if (!query) return pass(query);
  if (auto row = query->step(); !row) return pass(row);
  return static_cast<std::uint64_t>(query->integer(0));
}

Result<void> StateDb::save_job(const JobEntry& job) {
  auto write = database_.prepare("INSERT OR REPLACE INTO jobs VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  if (!write) return pass(write);
  auto queue = database_.prepare(
      "INSERT INTO queue VALUES(?, (SELECT coalesce(max(place), 0) + 1 FROM queue), ?, ?) "
      "ON CONFLICT(job) DO UPDATE SET hold = excluded.hold, "
      "needs_sample_change = excluded.needs_sample_change");
  if (!queue) return pass(queue);
  queue->bind(1, static_cast<std::int64_t>(job.id)).bind(2, std::string_view(job.hold));
  queue->bind(3, std::int64_t{job.needs_sample_change ? 1 : 0});
  write->bind(1, static_cast<std::int64_t>(job.id)).bind(2, std::string_view(job.name));
  write->bind(3, std::string_view(job.sample)).bind(4, std::string_view(job.scan_folder));
  write->bind(5, static_cast<std::int64_t>(job.state))
      .bind(6, job.poses)
      .bind(7, job.done)
      .bind(8, job.abandoned);
  write->bind(9, job.retries).bind(10, std::string_view(job.reason));
  // A complete one's report is written before this, and noted by that.
  auto due = database_.prepare(
      "INSERT OR IGNORE INTO reports_due SELECT ?1 WHERE ?2 IN (3, 4) AND NOT EXISTS "
      "(SELECT 1 FROM jobs WHERE id = ?1 AND state = ?2)");
  if (!due) return pass(due);
  due->bind(1, static_cast<std::int64_t>(job.id)).bind(2, static_cast<std::int64_t>(job.state));
  return database_.transaction([&]() -> Result<void> {
    if (auto done = due->run(); !done) return done;
    if (auto done = write->run(); !done) return done;
    return queue->run();
  });
}

Result<std::vector<std::uint64_t>> StateDb::reports_due() const {
  std::vector<std::uint64_t> due;
  auto done = scan::for_each(
      database_.prepare("SELECT job FROM reports_due JOIN jobs ON id = job WHERE state >= 2 ORDER BY job"),
      [&due](const scan::Statement& row) { due.push_back(static_cast<std::uint64_t>(row.integer(0))); });
  if (!done) return pass(done);
  return due;
}

Result<void> StateDb::note_report_due(std::uint64_t job) {
  auto note = database_.prepare("INSERT OR IGNORE INTO reports_due VALUES(?)");
  if (!note) return pass(note);
  return note->bind(1, static_cast<std::int64_t>(job)).run();
}

Result<void> StateDb::forget_report_due(std::uint64_t job) {
  auto forget = database_.prepare("DELETE FROM reports_due WHERE job = ?");
  if (!forget) return pass(forget);
  return forget->bind(1, static_cast<std::int64_t>(job)).run();
}

Result<void> StateDb::save_order(const std::vector<std::uint64_t>& jobs) {
  auto write = database_.prepare(
      "INSERT INTO queue VALUES(?, ?, '', 0) ON CONFLICT(job) DO UPDATE SET place = excluded.place");
  if (!write) return pass(write);
  return database_.transaction([&]() -> Result<void> {
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      write->bind(1, static_cast<std::int64_t>(jobs[i])).bind(2, static_cast<std::int64_t>(i));
      if (auto done = write->run(); !done) return done;
    }
    return {};
  });
}

Result<void> StateDb::add_event(const scan::EventRecord& event) {
  if (auto eased = database_.execute("PRAGMA synchronous = NORMAL"); !eased) return eased;
  const auto write = [&]() -> Result<void> {
    auto insert = database_.prepare("INSERT OR REPLACE INTO events VALUES(?, ?, ?, ?)");
    if (!insert) return pass(insert);
    insert->bind(1, static_cast<std::int64_t>(event.epoch)).bind(2, static_cast<std::int64_t>(event.number));
    insert->bind(3, event.time.time_since_epoch().count()).bind_blob(4, event.payload);
    return insert->run();
  };
  auto done = write();
  if (auto strict = database_.execute("PRAGMA synchronous = FULL"); !strict) return strict;
  return done;
}

Result<std::vector<scan::EventRecord>> StateDb::last_events(std::size_t most) {
  auto trim = database_.prepare(
      "DELETE FROM events WHERE (epoch, number) <= (SELECT epoch, number FROM events "
      "ORDER BY epoch DESC, number DESC LIMIT 1 OFFSET ?)");
  if (!trim) return pass(trim);
  if (auto done = trim->bind(1, static_cast<std::int64_t>(most)).run(); !done) return pass(done);
  auto query = database_.prepare("SELECT epoch, number, time_ns, payload FROM events ORDER BY epoch, number");
  if (!query) return pass(query);
  std::vector<scan::EventRecord> events;
  while (true) {
    auto row = query->step();
    if (!row) return pass(row);
    if (!*row) return events;
    events.push_back({static_cast<std::uint64_t>(query->integer(0)),
                      static_cast<std::uint64_t>(query->integer(1)),
                      base::Time(base::Duration(query->integer(2))), query->text(3)});
  }
}

Result<std::string> StateDb::fact(const char* key) const {
  auto read = database_.prepare("SELECT value FROM facts WHERE key = ?");
  if (!read) return pass(read);
  read->bind(1, std::string_view(key));
  auto row = read->step();
  if (!row) return pass(row);
  return *row ? read->text(0) : std::string();
}

Result<void> StateDb::save_fact(const char* key, const std::string& value) {
  auto write = database_.prepare("INSERT OR REPLACE INTO facts VALUES(?, ?)");
  if (!write) return pass(write);
  return write->bind(1, std::string_view(key)).bind(2, std::string_view(value)).run();
}

Result<std::string> StateDb::stopped() const {
  return fact("stopped");
}
Result<void> StateDb::save_stopped(const std::string& reason) {
  return save_fact("stopped", reason);
}
Result<std::string> StateDb::lease_holder() const {
  return fact("lease_holder");
}
Result<void> StateDb::save_lease_holder(const std::string& holder) {
  return save_fact("lease_holder", holder);
}

}  // namespace rig::daemon
