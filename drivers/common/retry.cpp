#include "drivers/common/retry.h"

namespace rig::drivers {

using base::ErrorCode;
using std::chrono::milliseconds;

RetryPolicy read_retry_policy(const base::ConfigTable& settings) {
  RetryPolicy policy;
  policy.attempts = static_cast<int>(settings.integer_or("attempts", policy.attempts, 1, 10));
  policy.answer = milliseconds(settings.integer_or("answer_ms", policy.answer.count(), 1, 10000));
  policy.call = milliseconds(settings.integer_or("call_ms", policy.call.count(), 10, 60000));
  if (policy.call < policy.longest()) {
    settings.error("call_ms",
                   fmt::format("{} ms are less than the {} attempts of {} ms that one question may take",
                               policy.call.count(), policy.attempts, policy.answer.count()),
                   "raise call_ms, and rigd's own deadline above it, or lower attempts or answer_ms");
  }
  return policy;
}

base::Error given_up(base::Error last, int attempts) {
  last.code = last.code == ErrorCode::timeout ? ErrorCode::lost : ErrorCode::device;
  if (attempts > 1) last.what += fmt::format(", {} times", attempts);
  return last;
}

base::Error call_is_over(const base::Error* last, const std::string& where) {
  constexpr const char* kOver = "the call's time is over";
  base::Error error;
  error.where = where;
  if (last != nullptr) error = *last;
  error.code = ErrorCode::lost;
  error.what += (error.what.empty() ? "" : "; ") + std::string(kOver);
  if (error.hint.empty()) error.hint = "raise call_ms if the device is this slow";
  return error;
}

}  // namespace rig::drivers
