// Time is what the test says. Nothing waits in it.
#pragma once

#include <algorithm>

#include "core/base/clock.h"

namespace rig::drivers::testing {

class SetClock final : public base::Clock {
 public:
  [[nodiscard]] base::Time now() const override { return now_; }
  bool wait(base::WaitSlot&, std::optional<base::Time>, base::WaitFor) override { return true; }
  void notify(base::WaitSlot&) override {}
  void join() override {}
  void leave() override {}
  void not_before(base::Time time) override { now_ = std::max(now_, time); }
  void pass(double seconds) { now_ += base::seconds(seconds); }

 private:
  base::Time now_{base::seconds(1e6)};
};

}  // namespace rig::drivers::testing
