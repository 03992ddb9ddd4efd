// Something that is done every so often in the time of the wall, whatever clock the rig has.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace rig::daemon {

class WallTimer {
 public:
  /// Calls `due` on a thread of its own; it must only hand over.
  WallTimer(std::chrono::duration<double> period, std::function<void()> due)
      : thread_([this, period, due = std::move(due)] {
          auto next = std::chrono::steady_clock::now();
          std::unique_lock lock(mutex_);
          while (true) {
            next += std::chrono::duration_cast<std::chrono::steady_clock::duration>(period);
            if (changed_.wait_until(lock, next, [this] { return ending_; })) return;
            due();
          }
        }) {}
  WallTimer(const WallTimer&) = delete;
  WallTimer& operator=(const WallTimer&) = delete;
  ~WallTimer() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace rig::daemon
