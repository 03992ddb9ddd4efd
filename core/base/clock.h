// Time as a parameter. Everything that waits for the rig or stamps what it did takes a Clock, so that a night
// on the virtual rig takes minutes and a test never sleeps.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

namespace rig::base {

using Duration = std::chrono::nanoseconds;
/// Nanoseconds since 1970-01-01 UTC.
using Time = std::chrono::sys_time<Duration>;

[[nodiscard]] constexpr Duration seconds(double s) {
  return Duration(static_cast<Duration::rep>(s * 1e9));
}
[[nodiscard]] constexpr double to_seconds(Duration d) {
  return static_cast<double>(d.count()) * 1e-9;
}

/// What a deadline waits for. A discrete-event clock jumps to the next `rig` deadline; `person` deadlines
/// pass at the pace of the wall.
enum class WaitFor { rig, person };

/// Where one thread waits. Belongs to one waiting thread; any thread may notify it through the clock.
class WaitSlot {
 public:
  WaitSlot() = default;
  WaitSlot(const WaitSlot&) = delete;
  WaitSlot& operator=(const WaitSlot&) = delete;

 private:
  friend class SystemClock;
  friend class DiscreteEventClock;
  std::mutex mutex_;
  std::condition_variable condition_;
  bool notified_ = false;
  bool waiting_ = false;
  std::optional<Time> deadline_;
  WaitFor kind_ = WaitFor::rig;
};

class Clock {
 public:
  Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;
  virtual ~Clock() = default;

  [[nodiscard]] virtual Time now() const = 0;

  /// Waits in `slot` until notified (true; a notification sent before the call counts) or until `deadline`
  /// (false).
  virtual bool wait(WaitSlot& slot, std::optional<Time> deadline, WaitFor kind) = 0;
  virtual void notify(WaitSlot& slot) = 0;

  /// Counts one thread more or less whose work must hold simulated time still. Use ClockMember.
  virtual void join() = 0;
  virtual void leave() = 0;

  /// Moves a simulated clock forward to `time` if it is behind it (a restarted virtual rig goes on from the
  /// time it had); a clock of the real world ignores it.
  virtual void not_before(Time time) = 0;
};

/// The clock of the real world: UTC at construction, then monotonic.
[[nodiscard]] std::unique_ptr<Clock> make_system_clock();

/// A discrete-event clock: while every member thread waits in it and none has been notified, it jumps to the
/// earliest `rig` deadline; without one it runs at the pace of the wall. It holds still while any member
/// works.
[[nodiscard]] std::unique_ptr<Clock> make_discrete_event_clock(Time start);

/// Membership of a thread in a clock. Make it before the thread starts and move it in, so that no time passes
/// between.
class ClockMember {
 public:
  explicit ClockMember(Clock& clock) : clock_(&clock) { clock.join(); }
  ClockMember(ClockMember&& other) noexcept : clock_(std::exchange(other.clock_, nullptr)) {}
  ClockMember& operator=(ClockMember&&) = delete;
  ~ClockMember() {
    if (clock_ != nullptr) clock_->leave();
  }

 private:
  Clock* clock_;
};

/// A queue from any thread to one thread, which waits for it in the clock.
template <typename T>
class Mailbox {
 public:
  explicit Mailbox(Clock& clock) : clock_(clock) {}

  void push(T item) {
    {
      const std::lock_guard lock(mutex_);
      items_.push_back(std::move(item));
    }
    clock_.notify(slot_);
  }

  /// Ahead of everything queued: for stops.
  void push_front(T item) {
    {
      const std::lock_guard lock(mutex_);
      items_.push_front(std::move(item));
    }
    clock_.notify(slot_);
  }

  /// How many items wait.
  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return items_.size();
  }

  [[nodiscard]] std::optional<T> try_pop() {
    const std::lock_guard lock(mutex_);
    if (items_.empty()) return std::nullopt;
    std::optional<T> item(std::move(items_.front()));
    items_.pop_front();
    return item;
  }

  /// The next item; nothing once `deadline` has passed without one.
  [[nodiscard]] std::optional<T> pop(std::optional<Time> deadline = std::nullopt,
                                     WaitFor kind = WaitFor::rig) {
    while (true) {
      if (auto item = try_pop()) return item;
      if (!clock_.wait(slot_, deadline, kind)) return try_pop();
    }
  }

 private:
  Clock& clock_;
  mutable std::mutex mutex_;
  std::deque<T> items_;
  WaitSlot slot_;
};

}  // namespace rig::base
