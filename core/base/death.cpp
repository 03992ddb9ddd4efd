#include "core/base/death.h"

#include <array>
#include <atomic>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <unistd.h>

namespace rig::base {

namespace {

constexpr std::array<std::string_view, 4> kSteps{"write", "flush", "rename", "commit"};

struct Instant {
  std::string name;  // "before-write" ..., or "any"
  std::uint64_t number = 0;
};

std::optional<Instant> parsed(const char* text) {
  if (text == nullptr) return std::nullopt;
  const std::string_view all(text);
  const auto colon = all.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  Instant instant{std::string(all.substr(0, colon)), 0};
  const std::string_view number = all.substr(colon + 1);
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), instant.number);
  if (error != std::errc() || end != number.data() + number.size() || instant.number == 0)
    return std::nullopt;
  if (instant.name == "any") return instant;
  for (const std::string_view step : kSteps) {
    if (instant.name == "before-" + std::string(step) || instant.name == "after-" + std::string(step))
      return instant;
  }
  return std::nullopt;
}

void pass_instant(const char* when, DurableStep step) {
  static const std::optional<Instant> chosen = parsed(std::getenv("RIG_DIE_AT"));
  if (!chosen) return;
  static std::atomic<std::uint64_t> passed{0};
  const std::string_view name = chosen->name;
  const std::string_view what = kSteps.at(static_cast<std::size_t>(step));
  const bool counts = name == "any" || (name.starts_with(when) && name.ends_with(what));
  if (counts && ++passed == chosen->number) ::kill(::getpid(), SIGKILL);
}

}  // namespace

void die_before(DurableStep step) {
  pass_instant("before", step);
}

void die_after(DurableStep step) {
  pass_instant("after", step);
}

bool names_an_instant(const char* text) {
  return parsed(text).has_value();
}

}  // namespace rig::base
