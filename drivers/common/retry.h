// The one policy of every driver for answers that are late, missing or garbled.
#pragma once

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "core/base/config.h"
#include "core/base/result.h"

namespace rig::drivers {

/// When a call has to be over: made once, where rigd's call begins, and kept to by all that the call does.
using Deadline = std::chrono::steady_clock::time_point;

struct RetryPolicy {
  int attempts = 3;                       ///< at least 1, the first included
  std::chrono::milliseconds answer{200};  ///< how long one attempt may wait for its answer
  std::chrono::milliseconds call{800};    ///< how long one call may take, whatever number of transactions

  /// The longest that one transaction takes; a call must have time for one.
  [[nodiscard]] std::chrono::milliseconds longest() const { return answer * attempts; }
  /// Of a call that begins now.
  [[nodiscard]] Deadline call_ends() const { return std::chrono::steady_clock::now() + call; }
  /// A stop is sent, and may wait for its answer, however little is left of its call.
  [[nodiscard]] Deadline stop_ends(Deadline call_ends) const {
    return std::max(call_ends, std::chrono::steady_clock::now() + answer);
  }
};

/// The keys `attempts` (1 to 10, 3), `answer_ms` (1 to 10000, 200) and `call_ms` (10 to 60000, 800) of a
/// module's settings. That a call has no time for one transaction is a mistake, noted.
[[nodiscard]] RetryPolicy read_retry_policy(const base::ConfigTable& settings);

/// What is told when no attempt is left: `lost` of one that was silent last, `device` of one that was
/// garbled.
[[nodiscard]] base::Error given_up(base::Error last, int attempts);
/// What is told when the call's time is over: `lost`, with what went wrong last, if anything did.
[[nodiscard]] base::Error call_is_over(const base::Error* last, const std::string& where);

/// Calls `attempt` until it succeeds, again after ErrorCode::timeout and ErrorCode::damaged (a garbled
/// answer). Only for what may be done twice without harm: readings, absolute targets, stops. A device that
/// has given no answer to any attempt is `lost`; one whose last answer was garbled is a `device` error; any
/// other error is handed on at once.
///
/// `attempt` is told by when its answer has to be there: policy.answer from its beginning, and never later
/// than `call_ends`. With less than half of that time left none is begun, and the device, or what is at
/// `where`, is `lost` for this call.
template <typename Attempt>
[[nodiscard]] auto with_retries(const RetryPolicy& policy, Deadline call_ends, const std::string& where,
                                Attempt&& attempt) -> decltype(attempt(call_ends)) {
  base::Error last;
  for (int i = 1;; ++i) {
    const Deadline now = std::chrono::steady_clock::now();
    if (call_ends < now + policy.answer / 2) {
      return tl::unexpected<base::Error>(call_is_over(i == 1 ? nullptr : &last, where));
    }
    auto answer = attempt(std::min(now + policy.answer, call_ends));
    if (answer) return answer;
    const base::ErrorCode code = answer.error().code;
    if (code != base::ErrorCode::timeout && code != base::ErrorCode::damaged) return answer;
    last = std::move(answer.error());
    if (i == policy.attempts) return tl::unexpected<base::Error>(given_up(std::move(last), i));
  }
}

/// For what is no part of a call, and for calls that keep their time otherwise.
template <typename Attempt>
[[nodiscard]] auto with_retries(const RetryPolicy& policy, Attempt&& attempt) -> decltype(attempt()) {
  return with_retries(policy, Deadline::max(), {}, [&](Deadline) { return attempt(); });
}

}  // namespace rig::drivers
