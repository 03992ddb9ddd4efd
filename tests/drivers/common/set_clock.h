// A clock that stands until a test lets time pass.
#pragma once

#include "core/base/clock.h"

namespace rig::test {

class SetClock final : public base::Clock {
 public:
  [[nodiscard]] base::Time now() const override { return now_; }
  /// Waiting is over at once: the time until the deadline has passed.
  bool wait(base::WaitSlot& /*slot*/, std::optional<base::Time> deadline, base::WaitFor /*kind*/) override {
    if (deadline && *deadline > now_) now_ = *deadline;
    return false;
  }
  void notify(base::WaitSlot& /*slot*/) override {}
  void join() override {}
  void leave() override {}
  void not_before(base::Time time) override {
    if (time > now_) now_ = time;
  }

  void pass(base::Duration time) { now_ += time; }

 private:
  base::Time now_{std::chrono::hours(24 * 365 * 50)};
};

}  // namespace rig::test
