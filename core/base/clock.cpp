#include "core/base/clock.h"

#include <algorithm>
#include <vector>

namespace rig::base {

namespace {

Time wall_now() {
  return std::chrono::time_point_cast<Duration>(std::chrono::system_clock::now());
}

}  // namespace

class SystemClock final : public Clock {
 public:
  [[nodiscard]] Time now() const override {
    return start_utc_ +
           std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now() - start_steady_);
  }

  bool wait(WaitSlot& slot, std::optional<Time> deadline, WaitFor /*kind*/) override {
    std::unique_lock lock(slot.mutex_);
    const auto notified = [&slot] { return slot.notified_; };
    if (deadline) {
      slot.condition_.wait_until(lock, start_steady_ + (*deadline - start_utc_), notified);
    } else {
      slot.condition_.wait(lock, notified);
    }
    return std::exchange(slot.notified_, false);
  }

  void notify(WaitSlot& slot) override {
    {
      const std::lock_guard lock(slot.mutex_);
      slot.notified_ = true;
    }
    slot.condition_.notify_one();
  }

  void join() override {}
  void leave() override {}
  void not_before(Time /*time*/) override {}

 private:
  const std::chrono::steady_clock::time_point start_steady_ = std::chrono::steady_clock::now();
  const Time start_utc_ = wall_now();
};

// One mutex guards time, membership and every slot: waits are rare and short here, and a jump must see all of
// them.
class DiscreteEventClock final : public Clock {
 public:
  explicit DiscreteEventClock(Time start) : base_(start) {}

  [[nodiscard]] Time now() const override {
    const std::lock_guard lock(mutex_);
    return now_locked();
  }

  bool wait(WaitSlot& slot, std::optional<Time> deadline, WaitFor kind) override {
    std::unique_lock lock(mutex_);
    slot.deadline_ = deadline;
    slot.kind_ = kind;
    slot.waiting_ = true;
    waiting_.push_back(&slot);
    settle();
    while (!slot.notified_ && !(deadline && now_locked() >= *deadline)) {
      // Wall pace only matters to deadlines; a slot without one wakes by notification alone.
      if (running_at_wall_pace() && deadline) {
        slot.condition_.wait_for(lock, *deadline - now_locked());
      } else {
        slot.condition_.wait(lock);
      }
    }
    slot.waiting_ = false;
    std::erase(waiting_, &slot);
    settle();
    return std::exchange(slot.notified_, false);
  }

  void notify(WaitSlot& slot) override {
    const std::lock_guard lock(mutex_);
    slot.notified_ = true;
    settle();
    slot.condition_.notify_one();
  }

  void join() override {
    const std::lock_guard lock(mutex_);
    ++members_;
    settle();
  }

  void leave() override {
    const std::lock_guard lock(mutex_);
    --members_;
    settle();
  }

  void not_before(Time time) override {
    const std::lock_guard lock(mutex_);
    if (time > now_locked()) jump(time);
  }

 private:
  using Steady = std::chrono::steady_clock;

  [[nodiscard]] bool running_at_wall_pace() const { return wall_start_.has_value(); }

  [[nodiscard]] Time now_locked() const {
    if (!wall_start_) return base_;
    return base_ + std::chrono::duration_cast<Duration>(Steady::now() - *wall_start_);
  }

  void jump(Time time) {
    base_ = time;
    if (wall_start_) wall_start_ = Steady::now();
    wake_all();
  }

  void wake_all() {
    for (WaitSlot* slot : waiting_) slot->condition_.notify_one();
  }

  void hold() {
    base_ = now_locked();
    wall_start_.reset();
  }

  // Decides, after any change, whether time holds still, jumps or runs with the wall.
  void settle() {
    const auto idle = [](const WaitSlot* slot) { return !slot->notified_; };
    const auto all_idle = std::all_of(waiting_.begin(), waiting_.end(), idle);
    if (!all_idle || waiting_.size() < members_) {
      hold();
      return;
    }
    std::optional<Time> next;
    for (const WaitSlot* slot : waiting_) {
      if (slot->deadline_ && slot->kind_ == WaitFor::rig && (!next || *slot->deadline_ < *next))
        next = slot->deadline_;
    }
    if (next) {
      hold();
      jump(std::max(*next, base_));
      return;
    }
    if (!wall_start_) {
      wall_start_ = Steady::now();
      wake_all();
    }
  }

  mutable std::mutex mutex_;
  Time base_;
  std::optional<Steady::time_point> wall_start_;
  std::size_t members_ = 0;
  std::vector<WaitSlot*> waiting_;
};

std::unique_ptr<Clock> make_system_clock() {
  return std::make_unique<SystemClock>();
}

std::unique_ptr<Clock> make_discrete_event_clock(Time start) {
  return std::make_unique<DiscreteEventClock>(start);
}

}  // namespace rig::base
