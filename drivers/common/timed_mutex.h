// A mutex that is waited for within a bound.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace rig::drivers {

/// As std::timed_mutex, whose wait GCC 12's thread sanitizer does not see (pthread_mutex_clocklock), so that
/// all it guards looks like a race.
class TimedMutex {
 public:
  void lock() {
    std::unique_lock lock(mutex_);
    free_.wait(lock, [this] { return !held_; });
    held_ = true;
  }
  template <typename Rep, typename Period>
  [[nodiscard]] bool try_lock_for(std::chrono::duration<Rep, Period> bound) {
    std::unique_lock lock(mutex_);
    if (!free_.wait_for(lock, bound, [this] { return !held_; })) return false;
    held_ = true;
    return true;
  }
  void unlock() {
    {
      const std::lock_guard lock(mutex_);
      held_ = false;
    }
    free_.notify_one();
  }

 private:
  std::mutex mutex_;
  std::condition_variable free_;
  bool held_ = false;
};

}  // namespace rig::drivers
