#include "drivers/ptu_axis/reply.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>

namespace rig::drivers::ptu {

namespace {

constexpr std::size_t kLongestLine = 256;

bool is_letter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0;
}

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

char upper(char c) {
  return static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
}

std::string trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\0'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return std::string(text);
}

bool holds(std::string_view text, std::string_view capitals) {
  return std::search(text.begin(), text.end(), capitals.begin(), capitals.end(),
                     [](char a, char b) { return upper(a) == b; }) != text.end();
}

bool is_banner(std::string_view line) {
  constexpr std::array<std::string_view, 4> kMarks{"###", "PAN-TILT CONTROLLER", "INITIALIZING",
                                                   "RIGHTS RESERVED"};
  return std::any_of(kMarks.begin(), kMarks.end(), [&](std::string_view mark) { return holds(line, mark); });
}

struct Found {
  double value;
  std::string_view behind;
};

// The first number of a text, and what follows it.
std::optional<Found> find_number(std::string_view text) {
  const auto digit = std::find_if(text.begin(), text.end(), is_digit);
  if (digit == text.end()) return std::nullopt;
  auto at = static_cast<std::size_t>(digit - text.begin());
  if (at > 0 && text[at - 1] == '.') --at;
  if (at > 0 && text[at - 1] == '-') --at;
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + at, end, value, std::chars_format::fixed);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  return Found{value, std::string_view(stop, static_cast<std::size_t>(end - stop))};
}

}  // namespace

// "!P" at the beginning of what has come; whether it is one shows only with the byte behind it, because an
// error begins with "!" too.
std::optional<Reply> ReplyReader::take_limit() {
  if (rest_.size() < 3 || rest_[0] != '!') return std::nullopt;
  const char axis = upper(rest_[1]);
  if ((axis != 'P' && axis != 'T') || is_letter(rest_[2])) return std::nullopt;
  rest_.erase(0, 2);
  return Reply{Reply::Kind::limit, std::string(1, axis), {}};
}

std::optional<Reply> ReplyReader::next() {
  while (true) {
    rest_.erase(0, std::min(rest_.find_first_not_of("\r\n"), rest_.size()));
    if (auto limit = take_limit()) return limit;
    const std::size_t end = rest_.find_first_of("\r\n");
    const bool too_long = std::min(end, rest_.size()) > kLongestLine;
    if (end == std::string::npos && !too_long) return std::nullopt;
    const std::string line = rest_.substr(0, too_long ? kLongestLine : end);
    if (too_long) {
      rest_.erase(0, line.size());
      return Reply{Reply::Kind::noise, line, {}};
    }
    // Behind noise that has no end of its own the last one is whole.
    const std::size_t star = line.rfind('*');
    const std::size_t mark = star != std::string::npos ? star : line.find('!');
    if (mark != std::string::npos && line[mark] == '!' && !is_banner(line)) {
      // A limit behind an echo: what is left of the line is looked at again.
      rest_.erase(0, mark);
      if (auto limit = take_limit()) return limit;
      rest_.erase(0, line.size() - mark);
      return Reply{Reply::Kind::error, trimmed(line.substr(mark + 1)), trimmed(line.substr(0, mark))};
    }
    rest_.erase(0, line.size());
    if (is_banner(line)) return Reply{Reply::Kind::banner, trimmed(line), {}};
    if (mark != std::string::npos) {
      return Reply{Reply::Kind::fine, trimmed(line.substr(mark + 1)), trimmed(line.substr(0, mark))};
    }
    std::string text = trimmed(line);
    if (!text.empty()) return Reply{Reply::Kind::noise, std::move(text), {}};
  }
}

std::optional<double> number_in(std::string_view text) {
  const auto found = find_number(text);
  if (!found) return std::nullopt;
  return found->value;
}

bool is_terse(std::string_view text) {
  const auto found = find_number(text);
  return found && found->behind.empty() && !is_letter(text.front());
}

bool is_wordy(std::string_view text) {
  return !text.empty() && is_letter(text.front()) && holds(text, " IS ");
}

std::optional<double> temperature_c_in(std::string_view text) {
  while (const auto found = find_number(text)) {
    const std::string unit = trimmed(found->behind.substr(0, 6));
    if (holds(unit, "DEGF")) return (found->value - 32) / 1.8;
    if (holds(unit, "DEGC")) return found->value;
    text = found->behind;
  }
  return std::nullopt;
}

}  // namespace rig::drivers::ptu
