// Runs the program of [notify] in rig.toml on a thread of its own: nothing waits for it.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

#include "core/base/result.h"
#include "core/machine/unattended_config.h"

namespace rig::daemon {

/// Runs `command` with `occasion` as a further argument and `text` as its standard input, without a shell. An
/// Error where it cannot be started, says so by its status, or is not done in time; then it is killed with
/// all that it started.
[[nodiscard]] base::Result<void> run_notify(const machine::NotifyConfig& notify, const std::string& occasion,
                                            const std::string& text);

class Notifier {
 public:
  explicit Notifier(machine::NotifyConfig notify);
  /// What is queued is still told, each within its time.
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  /// From any thread; returns at once. Without a command nothing happens. Errors are logged.
  void tell(std::string occasion, std::string text);

 private:
  void run();

  struct Message {
    std::string occasion, text;
  };
  const machine::NotifyConfig notify_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Message> queue_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace rig::daemon
