#include "drivers/common/lamp_record.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/base/files.h"

namespace rig::drivers {

using base::Duration;
using base::ErrorCode;
using base::fail;
using base::Result;
using base::Time;

namespace {

constexpr Duration kWriteEvery = base::seconds(60);
constexpr Duration kLongestBreak = base::seconds(12 * 3600);
constexpr double kSecondsPerHour = 3600;
constexpr std::string_view kHead = "lamp 1\nhours ";
constexpr std::string_view kLit = "\nlit_at_ns ";

// The number at the head of `text`, which is cut off it.
template <typename Number>
bool take_number(std::string_view& text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

bool take_word(std::string_view& text, std::string_view word) {
  if (!text.starts_with(word)) return false;
  text.remove_prefix(word.size());
  return true;
}

}  // namespace

Result<LampRecord::Kept> LampRecord::read(const std::filesystem::path& file) {
  const auto content = base::read_file(file);
  if (!content) {
    if (content.error().code == ErrorCode::not_found) return Kept{};
    return base::pass(content);
  }
  Kept kept;
  std::int64_t lit_at_ns = 0;
  std::string_view text = *content;
  const bool whole = take_word(text, kHead) && take_number(text, kept.hours) && take_word(text, kLit) &&
                     take_number(text, lit_at_ns) && text == "\n";
  if (!whole || !std::isfinite(kept.hours) || kept.hours < 0 || lit_at_ns < 0) {
    return fail(ErrorCode::damaged, "this is no record of a lamp's hours", file.string(),
                "put back a copy, or remove the file to begin with 0 hours");
  }
  if (lit_at_ns > 0) kept.lit_at = Time(Duration(lit_at_ns));
  return kept;
}

Result<LampRecord> LampRecord::open(std::filesystem::path file, base::Clock& clock, Log log) {
  auto kept = read(file);
  if (!kept) return base::pass(kept);
  return LampRecord(std::move(file), clock, log, *kept);
}

LampRecord::LampRecord(std::filesystem::path file, base::Clock& clock, Log log, Kept kept)
    : file_(std::move(file)), clock_(&clock), log_(log), kept_(kept) {}

LampRecord::LampRecord(LampRecord&& other) noexcept
    : file_(std::move(other.file_)),
      clock_(other.clock_),
      log_(other.log_),
      kept_(other.kept_),
      broken_off_(other.broken_off_),
      lit_since_(other.lit_since_),
      written_at_(other.written_at_),
      unwritten_(std::exchange(other.unwritten_, false)),
      refused_(other.refused_) {}

LampRecord::~LampRecord() {
  if (unwritten_) write();
}

void LampRecord::note(bool lit) {
  const Time now = clock_->now();
  const bool was_lit = kept_.lit_at.has_value();
  if (was_lit && (lit || !broken_off_)) {
    const Duration most = broken_off_ ? kLongestBreak : Duration::max();
    const Duration burnt = std::clamp(now - *kept_.lit_at, Duration::zero(), most);
    kept_.hours += base::to_seconds(burnt) / kSecondsPerHour;
  }
  unwritten_ = unwritten_ || lit || was_lit;
  kept_.lit_at = lit ? std::optional(now) : std::nullopt;
  broken_off_ = false;
  if (!lit) lit_since_.reset();
  if (lit && !lit_since_) lit_since_ = now;
  if (lit != was_lit || (lit && now - written_at_ >= kWriteEvery)) write();
}

void LampRecord::forget() {
  broken_off_ = true;
  lit_since_.reset();
}

double LampRecord::hours() const {
  return kept_.hours;
}

double LampRecord::lit_for_s() const {
  return lit_since_ ? std::max(0.0, base::to_seconds(clock_->now() - *lit_since_)) : 0;
}

void LampRecord::write() {
  const std::int64_t lit_at_ns = kept_.lit_at ? kept_.lit_at->time_since_epoch().count() : 0;
  const auto ok =
      base::write_file_durably(file_, fmt::format("{}{}{}{}\n", kHead, kept_.hours, kLit, lit_at_ns));
  written_at_ = clock_->now();
  if (!ok && !refused_) log_(base::LogLevel::warning, "the lamp's hours are not kept: " + ok.error().text());
  refused_ = unwritten_ = !ok;
}

}  // namespace rig::drivers
