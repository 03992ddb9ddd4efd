#include "drivers/sixk_axis/reply.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>

namespace rig::drivers::sixk {

namespace {

constexpr std::size_t kLongestLine = 256;

bool is_letter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0;
}

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

std::string trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\0'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return std::string(text);
}

}  // namespace

std::optional<Reply> ReplyReader::next() {
  while (true) {
    constexpr std::string_view kBetween("\r\n \0", 4);
    rest_.erase(0, std::min(rest_.find_first_not_of(kBetween), rest_.size()));
    if (rest_.empty()) return std::nullopt;
    if (rest_[0] == '>' || rest_[0] == '?') {
      const bool fine = rest_[0] == '>';
      rest_.erase(0, 1);
      return Reply{fine ? Reply::Kind::fine : Reply::Kind::bad, {}};
    }
    if (rest_.size() > 1 && rest_[0] == '-' && rest_[1] == ' ') {
      rest_.erase(0, 1);
      return Reply{Reply::Kind::defining, {}};
    }
    const std::size_t end = rest_.find_first_of("\r\n");
    const bool too_long = std::min(end, rest_.size()) > kLongestLine;
    if (end == std::string::npos && !too_long) return std::nullopt;
    const std::string line = rest_.substr(0, too_long ? kLongestLine : end);
    rest_.erase(0, line.size());
    // Behind noise that has no end of its own the last one is whole.
    const std::size_t star = line.rfind('*');
    if (star != std::string::npos && !too_long) {
      return Reply{Reply::Kind::answer, trimmed(std::string_view(line).substr(star + 1))};
    }
    return Reply{Reply::Kind::line, trimmed(line)};
  }
}

std::optional<std::string> value_in(std::string_view answer, int axis, std::string_view name,
                                    bool nameless_allowed) {
  const auto letter = std::find_if(answer.begin(), answer.end(), is_letter);
  if (letter == answer.end()) {
    if (!nameless_allowed) return std::nullopt;
    return trimmed(answer);
  }
  const std::string_view prefix = answer.substr(0, static_cast<std::size_t>(letter - answer.begin()));
  std::string_view rest = answer.substr(prefix.size());
  const bool prefixed =
      std::all_of(prefix.begin(), prefix.end(), [](char c) { return is_digit(c) || c == '_' || c == '!'; });
  if (!prefixed || rest.size() < name.size()) return std::nullopt;
  const bool same = std::equal(name.begin(), name.end(), rest.begin(), [](char a, char b) {
    return a == std::toupper(static_cast<unsigned char>(b));
  });
  if (!same) return std::nullopt;
  rest.remove_prefix(name.size());
  if (!rest.empty() && is_letter(rest.front())) return std::nullopt;  // a longer name
  if (axis != 0 && (prefix.empty() || prefix.back() != static_cast<char>('0' + axis))) return std::nullopt;
  return trimmed(rest);
}

std::optional<double> number_in(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<Status> status_in(std::string_view text) {
  constexpr std::size_t kBits = 32;
  std::array<bool, kBits> bits{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '_' && count % 4 == 0 && count > 0 && text[i - 1] != '_') continue;
    if ((text[i] != '0' && text[i] != '1') || count == kBits) return std::nullopt;
    bits.at(count++) = text[i] == '1';
  }
  if (count != kBits || text.back() == '_') return std::nullopt;
  const auto bit = [&](std::size_t number) { return bits.at(number - 1); };  // as the manual counts them
  Status status;
  status.moving = bit(1);
  status.homed = bit(5);
  status.absolute = bit(6);
  status.stalled = bit(12);
  status.shut_down = bit(13);
  status.drive_fault = bit(14);
  status.positive_limit = bit(15) || bit(17);
  status.negative_limit = bit(16) || bit(18);
  status.strayed = bit(23);
  status.missed_zone = bit(25);
  return status;
}

std::string fault_of(const Status& status) {
  std::string fault;
  const auto add = [&](bool is, const char* what) {
    if (is) fault += fault.empty() ? what : std::string(", ") + what;
  };
  add(status.drive_fault, "drive fault");
  add(status.stalled, "the motor has stalled");
  add(status.strayed, "its position error is too large");
  add(status.missed_zone, "it did not reach its target zone in time");
  return fault;
}

}  // namespace rig::drivers::sixk
