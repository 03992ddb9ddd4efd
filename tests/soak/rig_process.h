// rigd as a child process, and the client that looks after it.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <sys/types.h>

#include "core/base/result.h"
#include "protocol/client.h"

namespace rig::soak {

class RigProcess {
 public:
  /// `die_at` is the value of RIG_DIE_AT, or empty.
  [[nodiscard]] static base::Result<RigProcess> start(const std::filesystem::path& rigd,
                                                      const std::filesystem::path& folder,
                                                      const std::string& die_at);
  RigProcess(RigProcess&& other) noexcept;
  RigProcess& operator=(RigProcess&& other) = delete;
  /// Kills it where it still runs.
  ~RigProcess();

  /// The answer to a request; nothing where the process died before it answered.
  [[nodiscard]] base::Result<std::optional<protocol::Reply>> ask(const protocol::Request& request);
  /// The next event, or nothing within `patience`.
  [[nodiscard]] base::Result<std::optional<protocol::Event>> next_event(std::chrono::milliseconds patience);

  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Whether it has ended by itself.
  [[nodiscard]] bool ended();
  /// Sends the signal where it still runs, and waits for the end: the exit status, or minus the signal.
  int end(int signal);

 private:
  RigProcess(pid_t pid, std::optional<protocol::Client> client) : pid_(pid), client_(std::move(client)) {}

  pid_t pid_ = -1;
  std::optional<int> status_;
  std::optional<protocol::Client> client_;
};

}  // namespace rig::soak
