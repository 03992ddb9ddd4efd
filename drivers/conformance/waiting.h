// Waiting in the bench's clock, real or simulated.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "core/base/clock.h"

namespace rig::drivers::conformance {

/// How many times longer than on a rig everything may take: RIG_PATIENCE of the environment, 1 without it.
/// For an emulated machine (tests/kernel), or one that is busy otherwise.
[[nodiscard]] inline double patience() {
  static const double factor = [] {
    const char* text = std::getenv("RIG_PATIENCE");
    return text == nullptr ? 1.0 : std::max(1.0, std::strtod(text, nullptr));
  }();
  return factor;
}
[[nodiscard]] inline base::Duration patient(base::Duration bound) {
  return std::chrono::duration_cast<base::Duration>(bound * patience());
}

/// Between two looks at a device.
inline constexpr base::Duration kLookEvery = std::chrono::milliseconds(10);

class Waiting {
 public:
  explicit Waiting(base::Clock& clock) : clock_(clock) {}

  [[nodiscard]] base::Time now() const { return clock_.now(); }
  void pause(base::Duration how_long) {
    (void)clock_.wait(slot_, clock_.now() + how_long, base::WaitFor::rig);
  }

  /// Looks every so often until `ready` says true (true), or `within`, times patience(), has passed (false).
  /// Looks at least once, and once after the end.
  template <typename Ready>
  [[nodiscard]] bool until(Ready&& ready, base::Duration within, base::Duration every = kLookEvery) {
    const base::Time end = now() + patient(within);
    while (!ready()) {
      if (now() >= end) return false;
      pause(every);
    }
    return true;
  }

 private:
  base::Clock& clock_;
  base::WaitSlot slot_;
};

/// How long something took, by the bench's clock and by the wall's: a call may wait in either.
class Stopwatch {
 public:
  explicit Stopwatch(const base::Clock& clock) : clock_(clock), began_(clock.now()) {}
  [[nodiscard]] base::Duration elapsed() const {
    return std::max<base::Duration>(clock_.now() - began_, std::chrono::steady_clock::now() - wall_began_);
  }

 private:
  const base::Clock& clock_;
  const base::Time began_;
  const std::chrono::steady_clock::time_point wall_began_ = std::chrono::steady_clock::now();
};

}  // namespace rig::drivers::conformance
