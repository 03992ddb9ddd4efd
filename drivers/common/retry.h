// The one policy of every driver for answers that are late, missing or garbled.
#pragma once

#include <chrono>
#include <utility>

#include "core/base/config.h"
#include "core/base/result.h"

namespace rig::drivers {

struct RetryPolicy {
  int attempts = 3;                       ///< at least 1, the first included
  std::chrono::milliseconds answer{200};  ///< how long one attempt may wait for its answer

  /// The longest that one transaction takes: rigd's own deadline for a call must be above it.
  [[nodiscard]] std::chrono::milliseconds longest() const { return answer * attempts; }
};

/// The keys `attempts` (1 to 10, 3) and `answer_ms` (1 to 10000, 200) of a module's settings.
[[nodiscard]] RetryPolicy read_retry_policy(const base::ConfigTable& settings);

/// Calls `attempt` until it succeeds, again after ErrorCode::timeout and ErrorCode::damaged (a garbled
/// answer). Only for what may be done twice without harm: readings, absolute targets, stops. A device that
/// has given no answer to any attempt is `lost`; one whose last answer was garbled is a `device` error; any
/// other error is handed on at once.
template <typename Attempt>
[[nodiscard]] auto with_retries(const RetryPolicy& policy, Attempt&& attempt) -> decltype(attempt()) {
  for (int i = 1;; ++i) {
    auto answer = attempt();
    if (answer) return answer;
    const bool silent = answer.error().code == base::ErrorCode::timeout;
    if (!silent && answer.error().code != base::ErrorCode::damaged) return answer;
    if (i < policy.attempts) continue;
    base::Error error = std::move(answer.error());
    error.code = silent ? base::ErrorCode::lost : base::ErrorCode::device;
    error.what += policy.attempts == 1 ? "" : fmt::format(", {} times", policy.attempts);
    return tl::unexpected<base::Error>(std::move(error));
  }
}

}  // namespace rig::drivers
