#include "sim/wire_log.h"

#include <cerrno>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace rig::sim {

base::Result<WireLog> WireLog::open(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (fd < 0) {
    return base::fail(base::ErrorCode::io, fmt::format("cannot be opened: {}", std::strerror(errno)),
                      path.string(), "wire_log names a file in a folder that exists");
  }
  return WireLog(fd);
}

WireLog::~WireLog() {
  if (fd_ >= 0) ::close(fd_);
}

void WireLog::stopped(std::string_view axis) const {
  constexpr long long kSecond_ns = 1'000'000'000;
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  const std::string line = fmt::format("{} stop {}\n", now.tv_sec * kSecond_ns + now.tv_nsec, axis);
  // One write to a file opened for appending: no reader sees half a line.
  (void)!::write(fd_, line.data(), line.size());
}

}  // namespace rig::sim
