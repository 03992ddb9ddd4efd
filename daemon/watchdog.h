// Says that rigd lives only when every part of it has said so.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace rig::daemon {

/// A part that must answer: the deciding loop, the worker of a bus, the storage thread.
struct WatchedPart {
  std::string name;
  /// Puts `answer` into the part's own queue; the part calls it when its turn has come. Any thread; also
  /// after the Watchdog is gone.
  std::function<void(std::function<void()> answer)> ask;
};

/// Asks all parts twice a period, and feeds once all have answered. While one is silent nothing is fed, and
/// one line in the log names it. Wall time, whatever clock the rig has.
class Watchdog {
 public:
  Watchdog(std::vector<WatchedPart> parts, std::chrono::microseconds period, std::function<void()> feed);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

 private:
  struct Answers;
  void run();
  void ask_those_that_answered();
  [[nodiscard]] std::string silent() const;

  const std::vector<WatchedPart> parts_;
  const std::chrono::microseconds period_;
  const std::function<void()> feed_;
  std::shared_ptr<Answers> answers_;  // shared with answers that come after the end
  std::thread thread_;
};

}  // namespace rig::daemon
