// How a check ends early: with its outcome, thrown to run_check.
#pragma once

#include <string>
#include <utility>

#include "drivers/conformance/suite.h"

namespace rig::drivers::conformance {

struct CheckEnded {
  Outcome outcome;
};

template <typename... Args>
[[noreturn]] void fail_check(fmt::format_string<Args...> format, Args&&... args) {
  throw CheckEnded{{Verdict::failed, fmt::format(format, std::forward<Args>(args)...)}};
}

/// As fail_check and require, for what must never be: no busy machine excuses it, and no further try takes it
/// back.
template <typename... Args>
[[noreturn]] void fail_for_good(fmt::format_string<Args...> format, Args&&... args) {
  throw CheckEnded{{Verdict::failed, fmt::format(format, std::forward<Args>(args)...), true}};
}
template <typename... Args>
void require_always(bool met, fmt::format_string<Args...> format, Args&&... args) {
  if (!met) fail_for_good(format, std::forward<Args>(args)...);
}

template <typename... Args>
[[noreturn]] void not_proven(fmt::format_string<Args...> format, Args&&... args) {
  throw CheckEnded{{Verdict::not_proven, fmt::format(format, std::forward<Args>(args)...)}};
}

template <typename... Args>
[[noreturn]] void does_not_concern(fmt::format_string<Args...> format, Args&&... args) {
  throw CheckEnded{{Verdict::none, fmt::format(format, std::forward<Args>(args)...)}};
}

template <typename... Args>
void require(bool met, fmt::format_string<Args...> format, Args&&... args) {
  if (!met) fail_check(format, std::forward<Args>(args)...);
}

/// "lost", "refused" ...
[[nodiscard]] const char* name_of(base::ErrorCode code);

/// "lost: /dev/ttyUSB0: no answer".
[[nodiscard]] std::string told(const base::Error& error);

/// The value of a call that has to succeed. `call` names it: "move_to while moving".
template <typename T>
T must(base::Result<T> result, std::string_view call) {
  if (!result) fail_check("{} had to succeed, but answered {}", call, told(result.error()));
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

}  // namespace rig::drivers::conformance
