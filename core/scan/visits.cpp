#include "core/scan/visits.h"

#include <chrono>

#include "core/base/files.h"
#include "core/base/hash.h"

namespace rig::scan {

namespace fs = std::filesystem;
using base::pass;
using base::Result;

namespace {

constexpr const char* kTables = R"sql(
CREATE TABLE IF NOT EXISTS visits(
  number INTEGER PRIMARY KEY, time_ns INTEGER NOT NULL, good INTEGER NOT NULL, what TEXT NOT NULL) STRICT;
CREATE TABLE IF NOT EXISTS looks(
  visit INTEGER NOT NULL REFERENCES visits(number), idx INTEGER NOT NULL, name TEXT NOT NULL, file TEXT NOT NULL,
  exposure_s REAL NOT NULL, started_ns INTEGER NOT NULL, sha256 TEXT NOT NULL, PRIMARY KEY(visit, idx)) STRICT;
CREATE TABLE IF NOT EXISTS look_means(
  visit INTEGER NOT NULL REFERENCES visits(number), look INTEGER NOT NULL, idx INTEGER NOT NULL,
  mean_dn REAL NOT NULL, PRIMARY KEY(visit, look, idx)) STRICT;
)sql";

base::Time time_at(const Statement& statement, int column) {
  return base::Time(base::Duration(statement.integer(column)));
}

}  // namespace

fs::path visit_folder(const fs::path& scan, std::int64_t number) {
  return scan / "references" / fmt::format("{:06}", number);
}
fs::path visit_part_folder(const fs::path& scan, std::int64_t number) {
  return scan / "references" / fmt::format("{:06}.part", number);
}

Result<std::string> store_look(const fs::path& scan, std::int64_t number, const std::string& name,
                               const FrameFacts& facts, int width, int height, const std::uint16_t* pixels) {
  auto bytes = encode_frame(facts, width, height, pixels);
  if (!bytes) return pass(bytes);
  const fs::path folder = visit_part_folder(scan, number);
  if (auto ok = base::make_folder_durably(folder); !ok) return pass(ok);
  if (auto ok = base::write_and_flush(folder / (name + ".tif"), *bytes); !ok) return pass(ok);
  return base::sha256_hex(*bytes);
}

Result<void> publish_visit(const fs::path& scan, std::int64_t number) {
  const fs::path part = visit_part_folder(scan, number);
  if (auto ok = base::flush_folder(part); !ok) return ok;
  // One that the journal does not know may lie there after a crash.
  return base::rename_durably(part, visit_folder(scan, number));
}

Result<void> make_visit_tables(const Database& database) {
  return database.execute(kTables);
}

Result<void> insert_visit(const Database& database, const VisitRecord& visit) {
  auto insert = database.prepare("INSERT INTO visits VALUES(?, ?, ?, ?)");
  if (!insert) return pass(insert);
  insert->bind(1, visit.number).bind(2, visit.when.time_since_epoch().count());
  insert->bind(3, std::int64_t{visit.good}).bind(4, std::string_view(visit.what));
  if (auto done = insert->run(); !done) return done;
  auto look = database.prepare("INSERT INTO looks VALUES(?, ?, ?, ?, ?, ?, ?)");
  if (!look) return pass(look);
  auto mean = database.prepare("INSERT INTO look_means VALUES(?, ?, ?, ?)");
  if (!mean) return pass(mean);
  for (std::size_t i = 0; i < visit.looks.size(); ++i) {
    const LookRecord& record = visit.looks[i];
    look->bind(1, visit.number).bind(2, static_cast<std::int64_t>(i)).bind(3, std::string_view(record.name));
    look->bind(4, std::string_view(record.file)).bind(5, record.exposure_s);
    look->bind(6, record.started.time_since_epoch().count()).bind(7, std::string_view(record.sha256));
    if (auto done = look->run(); !done) return done;
    for (std::size_t k = 0; k < record.means_dn.size(); ++k) {
      mean->bind(1, visit.number).bind(2, static_cast<std::int64_t>(i));
      mean->bind(3, static_cast<std::int64_t>(k)).bind(4, record.means_dn[k]);
      if (auto done = mean->run(); !done) return done;
    }
  }
  return {};
}

Result<std::vector<VisitRecord>> read_visits(const Database& database) {
  std::vector<VisitRecord> visits;
  bool there = false;
  auto done =
      for_each(database.prepare("SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = 'visits'"),
               [&](const Statement& /*row*/) { there = true; });
  if (!done) return pass(done);
  if (!there) return visits;
  done = for_each(database.prepare("SELECT number, time_ns, good, what FROM visits ORDER BY number"),
                  [&](const Statement& s) {
                    visits.push_back({s.integer(0), time_at(s, 1), s.integer(2) != 0, s.text(3), {}});
                  });
  if (!done) return pass(done);
  const auto visit_numbered = [&visits](std::int64_t number) -> VisitRecord* {
    for (VisitRecord& visit : visits) {
      if (visit.number == number) return &visit;
    }
    return nullptr;
  };
  done =
      for_each(database.prepare(
                   "SELECT visit, name, file, exposure_s, started_ns, sha256 FROM looks ORDER BY visit, idx"),
               [&](const Statement& s) {
                 VisitRecord* visit = visit_numbered(s.integer(0));
                 if (visit != nullptr)
                   visit->looks.push_back({s.text(1), s.text(2), s.number(3), time_at(s, 4), s.text(5), {}});
               });
  if (!done) return pass(done);
  done = for_each(database.prepare("SELECT visit, look, mean_dn FROM look_means ORDER BY visit, look, idx"),
                  [&](const Statement& s) {
                    VisitRecord* visit = visit_numbered(s.integer(0));
                    const auto look = static_cast<std::size_t>(s.integer(1));
                    if (visit != nullptr && look < visit->looks.size())
                      visit->looks[look].means_dn.push_back(s.number(2));
                  });
  if (!done) return pass(done);
  return visits;
}

}  // namespace rig::scan
