#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fcntl.h>
#include <map>
#include <optional>
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

constexpr const char* kEnding = ".tsv";
struct Name {
  Verdict verdict;
  bool for_good;
  const char* name;
};
constexpr Name kNames[] = {{Verdict::passed, false, "passed"},
                           {Verdict::failed, false, "failed"},
                           {Verdict::failed, true, "failed for good"},
                           {Verdict::not_proven, false, "not proven"},
                           {Verdict::none, false, "none"}};

const char* name_of(const Outcome& outcome) {
  for (const Name& known : kNames) {
    if (known.verdict == outcome.verdict && known.for_good == outcome.for_good) return known.name;
  }
  return "failed";
}

struct Line {
  Outcome outcome;
  int tries = 1;  // of a check that passed: those before it failed, and the text says why
};
using Column = std::map<std::string, Line>;

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

// Its parts up to the last, which may hold anything.
std::vector<std::string> parts_of(const std::string& line, std::size_t count) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  while (parts.size() + 1 < count) {
    const std::size_t tab = line.find('\t', begin);
    if (tab == std::string::npos) return {};
    parts.push_back(line.substr(begin, tab - begin));
    begin = tab + 1;
  }
  parts.push_back(line.substr(begin));
  return parts;
}

std::optional<Line> line_of(const std::vector<std::string>& parts) {
  if (parts.empty()) return std::nullopt;
  Line line;
  const auto* name = std::find_if(std::begin(kNames), std::end(kNames),
                                  [&](const Name& known) { return parts[1] == known.name; });
  const char* const end = parts[2].data() + parts[2].size();
  const auto [read, error] = std::from_chars(parts[2].data(), end, line.tries);
  if (name == std::end(kNames) || error != std::errc() || read != end) return std::nullopt;
  line.outcome = {name->verdict, parts[3], name->for_good};
  return line;
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
    const auto parts = parts_of(line, 4);
    auto read = line_of(parts);
    if (!read) {
      return fail(ErrorCode::damaged, "no line of a column: '" + line + "'",
                  fmt::format("{}:{}", path.string(), number), "remove the file and run the tests again");
    }
    column[parts[0]] = std::move(*read);
  }
  return column;
}

// What stands there after one more try.
Line after(const Line& before, Outcome now) {
  if (before.outcome.verdict == Verdict::failed && before.outcome.for_good)
    return {before.outcome, before.tries + 1};
  // Failed before, or passed at a further try already.
  const bool failed_once = before.outcome.verdict == Verdict::failed || before.tries > 1;
  if (!failed_once) return {std::move(now), 1};
  if (now.verdict == Verdict::passed) now.text = before.outcome.text;
  return {std::move(now), before.tries + 1};
}

std::string cell(const Column& column, const std::string& check) {
  const auto found = column.find(check);
  if (found == column.end()) return "not run";
  const Line& line = found->second;
  switch (line.outcome.verdict) {
    case Verdict::passed:
      return line.tries == 1 ? "passed" : fmt::format("passed at try {}", line.tries);
    case Verdict::failed:
      return "**failed**";
    case Verdict::not_proven:
      return "not proven";
    case Verdict::none:
      return "-";
  }
  return "?";
}

using Columns = std::map<std::string, Column>;

// A heading and a line for each cell that is `chosen`; nothing where none is.
template <typename Chosen>
std::string reasons(const Columns& columns, const char* heading, Chosen&& chosen) {
  std::string why;
  for (const auto& [module, column] : columns) {
    for (const Check& check : checks()) {
      const auto found = column.find(check.name);
      if (found == column.end() || !chosen(found->second)) continue;
      why += fmt::format("- {}, {}: {}\n", module, check.name, found->second.outcome.text);
    }
  }
  return why.empty() ? why : fmt::format("\n{}:\n\n{}", heading, why);
}

Result<Columns> read_columns(const std::vector<fs::path>& folders) {
  Columns columns;
  bool any = false;
  for (const fs::path& folder : folders) {
    std::error_code error;
    if (!fs::exists(folder, error)) continue;
    any = true;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      if (it->path().extension() != kEnding) continue;
      auto column = read_column(it->path());
      if (!column) return pass(column);
      columns.emplace(it->path().stem().string(), std::move(*column));
    }
    if (error) return fail(ErrorCode::io, error.message(), folder.string());
  }
  if (!any)
    return fail(ErrorCode::not_found, "there is no folder of columns", {}, "have the conformance tests run?");
  return columns;
}

}  // namespace

Result<std::vector<Outcome>> write_column(const fs::path& folder, const std::string& module,
                                          const std::vector<std::pair<Check, Outcome>>& outcomes,
                                          Earlier earlier) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fail(ErrorCode::io, error.message(), folder.string());
  auto lock = ColumnLock::take(folder);
  if (!lock) return pass(lock);
  const fs::path path = folder / (module + kEnding);
  auto column = read_column(path);
  if (!column) return pass(column);
  std::vector<Outcome> stand;
  for (const auto& [check, outcome] : outcomes) {
    const auto before = column->find(check.name);
    Line now{outcome, 1};
    now.outcome.text = one_line(now.outcome.text);
    if (earlier == Earlier::counts && before != column->end()) now = after(before->second, now.outcome);
    stand.push_back(now.outcome);
    (*column)[check.name] = std::move(now);
  }
  std::string text;
  for (const Check& check : checks()) {
    const auto found = column->find(check.name);
    if (found == column->end()) continue;
    const Line& line = found->second;
    text += fmt::format("{}\t{}\t{}\t{}\n", check.name, name_of(line.outcome), line.tries, line.outcome.text);
  }
  if (auto written = base::write_file_durably(path, std::string_view(text)); !written) return pass(written);
  return stand;
}

Result<std::string> table_of(const std::vector<fs::path>& folders) {
  const auto columns = read_columns(folders);
  if (!columns) return pass(columns);
  std::string head = "| check |";
  std::string rule = "| --- |";
  for (const auto& [module, column] : *columns) {
    head += fmt::format(" {} |", module);
    rule += " --- |";
  }
  std::string text = head + "\n" + rule + "\n";
  for (const Check& check : checks()) {
    text += fmt::format("| {} |", check.name);
    for (const auto& [module, column] : *columns) text += fmt::format(" {} |", cell(column, check.name));
    text += "\n";
  }
  text +=
      reasons(*columns, "Failed", [](const Line& line) { return line.outcome.verdict == Verdict::failed; });
  text += reasons(*columns, "Passed only at a further try; before",
                  [](const Line& line) { return line.outcome.verdict == Verdict::passed && line.tries > 1; });
  text += reasons(*columns, "Not proven",
                  [](const Line& line) { return line.outcome.verdict == Verdict::not_proven; });
  return text;
}

}  // namespace rig::drivers::conformance
