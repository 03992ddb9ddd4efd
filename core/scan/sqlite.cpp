#include "core/scan/sqlite.h"

#include <sqlite3.h>
#include <utility>

#include "core/base/death.h"

namespace rig::scan {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

tl::unexpected<base::Error> failure(sqlite3* database, std::string_view doing) {
  const char* file = sqlite3_db_filename(database, "main");
  const int code = sqlite3_errcode(database);
  const bool damaged = code == SQLITE_CORRUPT || code == SQLITE_NOTADB;
  std::string hint;
  if (code == SQLITE_FULL) hint = "free space on that file system";
  if (code == SQLITE_READONLY || code == SQLITE_CANTOPEN)
    hint = "check the permissions of the file and its folder";
  if (code == SQLITE_BUSY) hint = "another program is writing to it";
  return fail(damaged ? ErrorCode::damaged : ErrorCode::io,
              fmt::format("cannot {}: {}", doing, sqlite3_errmsg(database)), file != nullptr ? file : "",
              hint);
}

// The database knows its file's name only once it is open.
tl::unexpected<base::Error> cannot_open(sqlite3* database, const std::filesystem::path& path) {
  auto error = failure(database, "open");
  error.value().where = path.string();
  return error;
}

}  // namespace

Statement::Statement(Statement&& other) noexcept
    : database_(other.database_), statement_(std::exchange(other.statement_, nullptr)) {}

Statement::~Statement() {
  sqlite3_finalize(statement_);
}

Statement& Statement::bind(int index, std::int64_t value) {
  sqlite3_bind_int64(statement_, index, value);
  return *this;
}

Statement& Statement::bind(int index, double value) {
  sqlite3_bind_double(statement_, index, value);
  return *this;
}

Statement& Statement::bind(int index, std::string_view text) {
  sqlite3_bind_text(statement_, index, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
  return *this;
}

Statement& Statement::bind_blob(int index, std::string_view bytes) {
  sqlite3_bind_blob(statement_, index, bytes.data(), static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
  return *this;
}

Result<bool> Statement::step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return failure(database_, "run a statement");
}

Result<void> Statement::run() {
  // Outside a transaction a statement that writes is one by itself.
  const bool commits = sqlite3_get_autocommit(database_) != 0 && sqlite3_stmt_readonly(statement_) == 0;
  if (commits) base::die_before(base::DurableStep::commit);
  auto row = step();
  if (!row) return base::pass(row);
  if (commits) base::die_after(base::DurableStep::commit);
  reset();
  return {};
}

void Statement::reset() {
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_, column);
}
double Statement::number(int column) const {
  return sqlite3_column_double(statement_, column);
}

std::string Statement::text(int column) const {
  const void* data = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  return data == nullptr ? std::string()
                         : std::string(static_cast<const char*>(data), static_cast<std::size_t>(size));
}

Database::Database(Database&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}

Database& Database::operator=(Database&& other) noexcept {
  std::swap(handle_, other.handle_);
  return *this;
}

Database::~Database() {
  sqlite3_close_v2(handle_);
}

Result<Statement> Database::prepare(std::string_view sql) const {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(handle_, sql.data(), static_cast<int>(sql.size()), &statement, nullptr) !=
      SQLITE_OK) {
    return failure(handle_, "prepare a statement");
  }
  return Statement(handle_, statement);
}

Result<void> Database::execute(const std::string& sql) const {
  if (sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
    return failure(handle_, "write");
  return {};
}

Result<void> Database::commit() const {
  base::die_before(base::DurableStep::commit);
  if (auto done = execute("COMMIT"); !done) return done;
  base::die_after(base::DurableStep::commit);
  return {};
}

Result<void> Database::check_version(const std::filesystem::path& path, int user_version) const {
  auto version = prepare("PRAGMA user_version");
  if (!version) return base::pass(version);
  if (auto row = version->step(); !row) return base::pass(row);
  if (const auto found = version->integer(0); found > user_version) {
    return fail(ErrorCode::newer,
                fmt::format("version {} is newer than this program reads ({})", found, user_version),
                path.string(), "use a newer version");
  }
  return {};
}

Result<Database> Database::open_unchecked(const std::filesystem::path& path, int user_version) {
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &handle, SQLITE_OPEN_READWRITE, nullptr);
  Database database(handle);
  if (code != SQLITE_OK) return cannot_open(handle, path);
  if (auto ok = database.check_version(path, user_version); !ok) return base::pass(ok);
  return database;
}

Result<Database> Database::open(const std::filesystem::path& path, Mode mode, int user_version) {
  const bool exists = std::filesystem::exists(path);
  if (mode == Mode::create && exists) return fail(ErrorCode::refused, "exists already", path.string());
  if (mode != Mode::create && !exists)
    return fail(ErrorCode::not_found, "there is no such file", path.string());
  sqlite3* handle = nullptr;
  const int flags = mode == Mode::create  ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE
                    : mode == Mode::write ? SQLITE_OPEN_READWRITE
                                          : SQLITE_OPEN_READONLY;
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags, nullptr);
  Database database(handle);
  if (code != SQLITE_OK) return cannot_open(handle, path);
  constexpr int kBusyTimeout_ms = 5000;
  sqlite3_busy_timeout(handle, kBusyTimeout_ms);
  if (mode != Mode::read) {
    if (auto done =
            database.execute("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON");
        !done) {
      return base::pass(done);
    }
  }
  if (mode == Mode::create) {
    if (auto done = database.execute(fmt::format("PRAGMA user_version={}", user_version)); !done)
      return base::pass(done);
    return database;
  }
  if (auto ok = database.check_version(path, user_version); !ok) return base::pass(ok);
  auto check = database.prepare("PRAGMA quick_check(1)");
  if (!check) return base::pass(check);
  auto row = check->step();
  if (!row) return base::pass(row);
  if (const std::string verdict = check->text(0); verdict != "ok") {
    return fail(ErrorCode::damaged, fmt::format("is damaged: {}", verdict), path.string());
  }
  return database;
}

}  // namespace rig::scan
