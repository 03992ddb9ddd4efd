#include "drivers/common/retry.h"

namespace rig::drivers {

RetryPolicy read_retry_policy(const base::ConfigTable& settings) {
  RetryPolicy policy;
  policy.attempts = static_cast<int>(settings.integer_or("attempts", policy.attempts, 1, 10));
  policy.answer =
      std::chrono::milliseconds(settings.integer_or("answer_ms", policy.answer.count(), 1, 10000));
  return policy;
}

}  // namespace rig::drivers
