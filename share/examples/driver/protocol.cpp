#include "share/examples/driver/protocol.h"

#include <charconv>
#include <numeric>

namespace rig::drivers::turner {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

constexpr std::size_t kSumLength = 3;  // "*7A"

std::string sum_of(std::string_view bytes) {
  const unsigned sum = std::accumulate(bytes.begin(), bytes.end(), 0U, [](unsigned so_far, char byte) {
    return so_far + static_cast<unsigned char>(byte);
  });
  return fmt::format("*{:02X}", sum % 256);
}

auto garbled(std::string_view what, std::string_view line) {
  return fail(ErrorCode::damaged, fmt::format("{}: '{}'", what, line));
}

// Takes a whole number off the front of `text`, with the space before it.
bool take(std::string_view& text, std::int32_t& number) {
  if (text.empty() || text.front() != ' ') return false;
  text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

ErrorCode code_of(std::string_view reason) {
  if (reason == "busy") return ErrorCode::busy;
  if (reason == "fault" || reason == "off") return ErrorCode::device;
  return ErrorCode::refused;  // "unhomed", "limit", "range"
}

}  // namespace

std::string request(int tag, std::string_view text) {
  const std::string line = fmt::format("{}{}", tag, text);
  return line + sum_of(line) + "\n";
}

Result<std::string> answer(int tag, std::string_view line) {
  if (line.size() <= kSumLength) return garbled("too short for an answer", line);
  const std::string_view body = line.substr(0, line.size() - kSumLength);
  if (sum_of(body) != line.substr(body.size())) return garbled("an answer with a wrong sum", line);
  if (body.front() != static_cast<char>('0' + tag)) return garbled("an answer to another request", line);
  return std::string(body.substr(1));
}

Result<Report> report(std::string_view text) {
  std::string_view rest = text;
  Report report;
  std::int32_t flags = 0;
  if (rest.empty() || rest.front() != 'Q') return garbled("no report", text);
  rest.remove_prefix(1);
  if (!take(rest, report.counts) || !take(rest, flags) || !rest.empty() || flags < 0 || flags >= 64) {
    return garbled("no report", text);
  }
  const auto has = [flags](int bit) { return (flags & bit) != 0; };
  report.moving = has(1);
  report.homed = has(2);
  report.energised = has(4);
  report.at_low_limit = has(8);
  report.at_high_limit = has(16);
  report.fault = has(32);
  return report;
}

Result<void> verdict(char verb, std::string_view text) {
  if (text.empty() || text.front() != verb) return garbled("an answer to another request", text);
  const std::string_view rest = text.substr(1);
  constexpr std::string_view kNo = " no ";
  if (rest == " ok") return {};
  if (rest.substr(0, kNo.size()) != kNo) return garbled("neither yes nor no", text);
  const std::string_view reason = rest.substr(kNo.size());
  return fail(code_of(reason), fmt::format("the controller says no: {}", reason));
}

}  // namespace rig::drivers::turner
