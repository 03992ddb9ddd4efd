// Keeps a Tic's command timeout from passing, for as long as rigd shows that it is there.
//
// A Tic that is not spoken to for its command timeout (one second as delivered) brakes by itself: so the
// motor stops when this process dies, when the cable is pulled, when the machine hangs. rigd's own commands
// come too seldom to keep it running, so a thread of the module resets the timeout four times within it. A
// thread alone would keep the motor going for ever if rigd's worker hung and the thread did not; so it stops
// when the worker has made no call for `silence`, and the Tic brakes. From the last call to the beginning of
// braking pass at most: silence + a quarter of the command timeout + the command timeout.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "drivers/tic_axis/link.h"

namespace rig::drivers::tic {

/// When the worker last made a call. Any thread.
class Heartbeat {
 public:
  void beat() { last_ = std::chrono::steady_clock::now().time_since_epoch().count(); }
  [[nodiscard]] std::chrono::steady_clock::duration age() const {
    return std::chrono::steady_clock::now().time_since_epoch() - std::chrono::steady_clock::duration(last_);
  }

 private:
  std::atomic<std::chrono::steady_clock::rep> last_{0};
};

struct FeederTimes {
  std::chrono::milliseconds every{250};
  std::chrono::milliseconds silence{2000};
};

/// Feeds from its making to its end. It keeps the machine's own time, not rigd's Clock: the Tic does, too.
class Feeder {
 public:
  /// Tells in words, from its thread, that it stops because of silence and that it goes on.
  using Tell = std::function<void(const std::string&)>;

  Feeder(Link& link, const Heartbeat& heart, const FeederTimes& times, Tell tell);
  ~Feeder();
  Feeder(const Feeder&) = delete;
  Feeder& operator=(const Feeder&) = delete;

 private:
  void run();
  [[nodiscard]] bool wait();

  Link& link_;
  const Heartbeat& heart_;
  const FeederTimes times_;
  const Tell tell_;
  std::mutex mutex_;
  std::condition_variable ending_changed_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace rig::drivers::tic
