// Runs the program of [notify] in rig.toml on a thread of its own: nothing waits for it.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
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
  /// finish()es.
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  /// From any thread; returns at once. Errors are logged. `told` is called, on the notifier's thread, once
  /// the command has ended, in whatever way; where there is no command, at once. Never, where there is too
  /// much to tell.
  void tell(std::string occasion, std::string text, std::function<void()> told = {});

  /// What is queued is still told, each within its time. Nothing may be told afterwards.
  void finish();

 private:
  void run();

  struct Message {
    std::string occasion, text;
    std::function<void()> told;
  };
  const machine::NotifyConfig notify_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Message> queue_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace rig::daemon
