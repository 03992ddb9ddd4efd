// How long something takes, over and over, in wall time. The one thing that threads share beside their queues
// and the frame pool: numbers that nothing is decided on.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <mutex>

namespace rig::daemon {

class Timings {
 public:
  struct Summary {
    std::uint64_t count = 0;  ///< since the start
    double total_s = 0;       ///< since the start
    double worst_s = 0;       ///< since forget_worst()
  };

  /// Measures from its making to its end.
  class Measure {
   public:
    explicit Measure(Timings& timings) : timings_(timings) {}
    Measure(const Measure&) = delete;
    Measure& operator=(const Measure&) = delete;
    ~Measure() { timings_.add(std::chrono::steady_clock::now() - start_); }

   private:
    Timings& timings_;
    const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  };

  void add(std::chrono::duration<double> took) {
    const std::lock_guard lock(mutex_);
    ++summary_.count;
    summary_.total_s += took.count();
    summary_.worst_s = std::max(summary_.worst_s, took.count());
  }
  [[nodiscard]] Summary summary() const {
    const std::lock_guard lock(mutex_);
    return summary_;
  }
  void forget_worst() {
    const std::lock_guard lock(mutex_);
    summary_.worst_s = 0;
  }

 private:
  mutable std::mutex mutex_;
  Summary summary_;
};

}  // namespace rig::daemon
