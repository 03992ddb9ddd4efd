#include "clients/rig/text_difference.h"

#include <algorithm>
#include <fmt/format.h>
#include <vector>

namespace rig::client {

namespace {

constexpr std::size_t kAround = 3;

struct Line {
  char mark;  // ' ' in both, '-' only before, '+' only after
  std::string_view text;
};

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    lines.push_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return lines;
}

// The longest common subsequence says what stays. rig.toml has hundreds of lines: a table of all pairs will
// do.
std::vector<Line> compared(const std::vector<std::string_view>& a, const std::vector<std::string_view>& b) {
  std::vector<std::vector<std::size_t>> common(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = a.size(); i-- > 0;) {
    for (std::size_t j = b.size(); j-- > 0;) {
      common[i][j] = a[i] == b[j] ? common[i + 1][j + 1] + 1 : std::max(common[i + 1][j], common[i][j + 1]);
    }
  }
  std::vector<Line> lines;
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() || j < b.size()) {
    if (i < a.size() && j < b.size() && a[i] == b[j]) {
      lines.push_back({' ', a[i++]});
      ++j;
    } else if (i < a.size() && (j == b.size() || common[i + 1][j] >= common[i][j + 1])) {
      lines.push_back({'-', a[i++]});
    } else {
      lines.push_back({'+', b[j++]});
    }
  }
  return lines;
}

std::string range(std::size_t before, std::size_t count) {
  // An empty range is named by the line before it.
  return fmt::format("{},{}", count == 0 ? before : before + 1, count);
}

}  // namespace

std::string unified_difference(std::string_view before, std::string_view after,
                               const std::string& name_before, const std::string& name_after) {
  const auto lines = compared(lines_of(before), lines_of(after));
  std::string out;
  std::size_t at_before = 0;  // lines of either text that are behind us
  std::size_t at_after = 0;
  for (std::size_t i = 0; i < lines.size();) {
    const auto changed = [&](std::size_t k) { return lines[k].mark != ' '; };
    std::size_t next = i;
    while (next < lines.size() && !changed(next)) ++next;
    if (next == lines.size()) break;
    const std::size_t begin = std::max(i, next - std::min(next, kAround));
    at_before += begin - i;
    at_after += begin - i;
    // Changes with less than two contexts between them are one.
    std::size_t end = next + 1;
    for (std::size_t k = end; k < lines.size() && k < end + 2 * kAround + 1; ++k) {
      if (changed(k)) end = k + 1;
    }
    end = std::min(end + kAround, lines.size());
    std::string body;
    std::size_t of_before = 0;
    std::size_t of_after = 0;
    for (std::size_t k = begin; k < end; ++k) {
      body += fmt::format("{}{}\n", lines[k].mark, lines[k].text);
      if (lines[k].mark != '+') ++of_before;
      if (lines[k].mark != '-') ++of_after;
    }
    if (out.empty()) out = fmt::format("--- {}\n+++ {}\n", name_before, name_after);
    out += fmt::format("@@ -{} +{} @@\n{}", range(at_before, of_before), range(at_after, of_after), body);
    at_before += of_before;
    at_after += of_after;
    i = end;
  }
  return out;
}

}  // namespace rig::client
