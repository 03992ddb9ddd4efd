#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <map>
#include <sys/file.h>
#include <unistd.h>

#include "core/base/files.h"
#include "drivers/conformance/suite.h"

namespace rig::drivers::conformance {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr const char* kEnding = ".txt";
constexpr std::pair<Verdict, const char*> kNames[] = {{Verdict::passed, "passed"},
                                                      {Verdict::failed, "failed"},
                                                      {Verdict::not_proven, "not proven"},
                                                      {Verdict::none, "none"}};

const char* name_of(Verdict verdict) {
  for (const auto& [known, name] : kNames) {
    if (known == verdict) return name;
  }
  return "failed";
}

using Column = std::map<std::string, Outcome>;

// Held while a column is read, changed and written: tests run in several processes at once.
class ColumnLock {
 public:
  static Result<ColumnLock> take(const fs::path& folder) {
    const fs::path path = folder / ".lock";
    const int fd = ::open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
    if (fd < 0) return fail(ErrorCode::io, std::strerror(errno), path.string());
    ColumnLock lock(fd);
    int locked = 0;
    do locked = ::flock(fd, LOCK_EX);
    while (locked != 0 && errno == EINTR);
    if (locked != 0) return fail(ErrorCode::io, std::strerror(errno), path.string());
    return lock;
  }
  ColumnLock(ColumnLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  ColumnLock& operator=(ColumnLock&&) = delete;
  ~ColumnLock() {
    if (fd_ >= 0) ::close(fd_);
  }

 private:
  explicit ColumnLock(int fd) : fd_(fd) {}
  int fd_;
};

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\t' || c == '\n' || c == '\r'; }, ' ');
  return text;
}

Result<Column> read_column(const fs::path& path) {
  Column column;
  if (!fs::exists(path)) return column;
  auto text = base::read_file(path);
  if (!text) return pass(text);
  std::size_t begin = 0;
  for (int number = 1; begin < text->size(); ++number) {
    const std::size_t end = std::min(text->find('\n', begin), text->size());
    const std::string line = text->substr(begin, end - begin);
    begin = end + 1;
    const std::size_t first = line.find('\t');
    const std::size_t second = first == std::string::npos ? first : line.find('\t', first + 1);
    const auto* found = second == std::string::npos
                            ? std::end(kNames)
                            : std::find_if(std::begin(kNames), std::end(kNames), [&](const auto& known) {
                                return line.compare(first + 1, second - first - 1, known.second) == 0;
                              });
    if (found == std::end(kNames)) {
      return fail(ErrorCode::damaged, "no line of a column: '" + line + "'",
                  fmt::format("{}:{}", path.string(), number), "remove the file and run the tests again");
    }
    column[line.substr(0, first)] = {found->first, line.substr(second + 1)};
  }
  return column;
}

std::string cell(const Column& column, const std::string& check) {
  const auto found = column.find(check);
  if (found == column.end()) return "not run";
  switch (found->second.verdict) {
    case Verdict::passed:
      return "passed";
    case Verdict::failed:
      return "**failed**";
    case Verdict::not_proven:
      return "not proven";
    case Verdict::none:
      return "-";
  }
  return "?";
}

}  // namespace

Result<void> write_column(const fs::path& folder, const std::string& module,
                          const std::vector<std::pair<Check, Outcome>>& outcomes) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fail(ErrorCode::io, error.message(), folder.string());
  auto lock = ColumnLock::take(folder);
  if (!lock) return pass(lock);
  const fs::path path = folder / (module + kEnding);
  auto column = read_column(path);
  if (!column) return pass(column);
  for (const auto& [check, outcome] : outcomes) (*column)[check.name] = outcome;
  std::string text;
  for (const Check& check : checks()) {
    const auto found = column->find(check.name);
    if (found == column->end()) continue;
    text +=
        fmt::format("{}\t{}\t{}\n", check.name, name_of(found->second.verdict), one_line(found->second.text));
  }
  return base::write_file_durably(path, std::string_view(text));
}

Result<std::string> table_of(const fs::path& folder) {
  std::map<std::string, Column> columns;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() != kEnding) continue;
    auto column = read_column(it->path());
    if (!column) return pass(column);
    columns.emplace(it->path().stem().string(), std::move(*column));
  }
  if (error) return fail(ErrorCode::io, error.message(), folder.string(), "have the conformance tests run?");
  std::string head = "| check |";
  std::string rule = "| --- |";
  for (const auto& [module, column] : columns) {
    head += fmt::format(" {} |", module);
    rule += " --- |";
  }
  std::string text = head + "\n" + rule + "\n";
  for (const Check& check : checks()) {
    text += fmt::format("| {} |", check.name);
    for (const auto& [module, column] : columns) text += fmt::format(" {} |", cell(column, check.name));
    text += "\n";
  }
  for (const Verdict verdict : {Verdict::failed, Verdict::not_proven}) {
    std::string why;
    for (const auto& [module, column] : columns) {
      for (const Check& check : checks()) {
        const auto found = column.find(check.name);
        if (found == column.end() || found->second.verdict != verdict) continue;
        why += fmt::format("- {}, {}: {}\n", module, check.name, found->second.text);
      }
    }
    if (!why.empty())
      text += fmt::format("\n{}:\n\n{}", verdict == Verdict::failed ? "Failed" : "Not proven", why);
  }
  return text;
}

}  // namespace rig::drivers::conformance
