// A lock that is had in the order in which it was asked for. With std::mutex a thread that asks again at once
// has it again: the feeder would wait for as long as a silent Tic is asked and asked.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace rig::drivers::tic {

/// For std::lock_guard.
class FairLock {
 public:
  void lock() {
    std::unique_lock lock(mutex_);
    const std::uint64_t mine = next_++;
    turn_.wait(lock, [&] { return serving_ == mine; });
  }
  void unlock() {
    {
      const std::lock_guard lock(mutex_);
      ++serving_;
    }
    turn_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable turn_;
  std::uint64_t next_ = 0, serving_ = 0;
};

}  // namespace rig::drivers::tic
