// SQLite with its statements finalised and its errors as values; for the journal, and for the state of rigd.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace rig::scan {

/// One prepared statement. Parameters are numbered from 1, columns from 0.
class Statement {
 public:
  Statement(sqlite3* database, sqlite3_stmt* statement) : database_(database), statement_(statement) {}
  Statement(Statement&& other) noexcept;
  Statement& operator=(Statement&&) = delete;
  ~Statement();

  Statement& bind(int index, std::int64_t value);
  Statement& bind(int index, double value);
  Statement& bind(int index, std::string_view text);
  Statement& bind_blob(int index, std::string_view bytes);

  /// True: a row is there to read. False: done.
  [[nodiscard]] base::Result<bool> step();
  /// For statements without rows.
  [[nodiscard]] base::Result<void> run();
  /// Ready to be bound and run again.
  void reset();

  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double number(int column) const;
  [[nodiscard]] std::string text(int column) const;

 private:
  sqlite3* database_;
  sqlite3_stmt* statement_;
};

/// One connection, in WAL mode with full synchronisation when writable: what was committed is on the disk.
class Database {
 public:
  enum class Mode { create, write, read };

  /// `create` fails where the file exists. `user_version` is set by create; opening one with a greater
  /// version is ErrorCode::newer, and a damaged file ErrorCode::damaged.
  [[nodiscard]] static base::Result<Database> open(const std::filesystem::path& path, Mode mode,
                                                   int user_version);
  /// One that may be damaged, for whatever can still be read of it; no newer version either.
  [[nodiscard]] static base::Result<Database> open_unchecked(const std::filesystem::path& path,
                                                             int user_version);
  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  [[nodiscard]] base::Result<Statement> prepare(std::string_view sql) const;
  [[nodiscard]] base::Result<void> execute(const std::string& sql) const;

  /// Runs `body` in one transaction: committed if it succeeds, rolled back whole if it fails.
  template <typename Body>
  [[nodiscard]] base::Result<void> transaction(Body&& body) const {
    if (auto begun = execute("BEGIN IMMEDIATE"); !begun) return begun;
    base::Result<void> done = body();
    if (done) done = commit();
    if (!done) {
      // The first error is the one to report; a rollback can only fail where nothing was begun.
      (void)execute("ROLLBACK");
    }
    return done;
  }

 private:
  explicit Database(sqlite3* handle) : handle_(handle) {}
  [[nodiscard]] base::Result<void> commit() const;
  [[nodiscard]] base::Result<void> check_version(const std::filesystem::path& path, int user_version) const;
  sqlite3* handle_;
};

/// Every row of a query, which may have failed to be prepared, through `each(const Statement&)`.
template <typename Each>
[[nodiscard]] base::Result<void> for_each(base::Result<Statement> query, Each&& each) {
  if (!query) return base::pass(query);
  while (true) {
    const auto row = query->step();
    if (!row) return base::pass(row);
    if (!*row) return {};
    each(*query);
  }
}

}  // namespace rig::scan
