// When a stop reached the simulated drives, by the clock of the machine that runs rigd: what measures how
// long a stop takes from a client to the wire.
#pragma once

#include <filesystem>
#include <string_view>
#include <utility>

#include "core/base/result.h"

namespace rig::sim {

class WireLog {
 public:
  /// Appends to `path`, which is made where it does not exist.
  [[nodiscard]] static base::Result<WireLog> open(const std::filesystem::path& path);
  WireLog(WireLog&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  WireLog& operator=(WireLog&&) = delete;
  ~WireLog();

  /// One line: CLOCK_MONOTONIC in nanoseconds, "stop", the axis. It is whole in the file when this returns;
  /// where the disk takes no line none is kept, and the axis stops all the same.
  void stopped(std::string_view axis) const;

 private:
  explicit WireLog(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace rig::sim
