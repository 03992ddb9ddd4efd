#include "sim/press_watch.h"

#include <array>
#include <cstring>
#include <string_view>
#include <sys/inotify.h>
#include <unistd.h>

namespace rig::sim {

namespace fs = std::filesystem;

PressWatch::PressWatch(const fs::path& folder, const std::string& name)
    : path_(folder / name), fd_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
  if (fd_ >= 0) (void)::inotify_add_watch(fd_, folder.c_str(), IN_CREATE | IN_MOVED_TO);
}

PressWatch::~PressWatch() {
  if (fd_ >= 0) ::close(fd_);
}

bool PressWatch::held() const {
  std::error_code unreadable_is_released;
  return fs::exists(path_, unreadable_is_released);
}

bool PressWatch::made() {
  bool seen = false;
  alignas(inotify_event) std::array<char, 4096> events{};
  while (fd_ >= 0) {
    const ssize_t count = ::read(fd_, events.data(), events.size());
    if (count <= 0) break;
    for (std::size_t at = 0; at < static_cast<std::size_t>(count);) {
      inotify_event event{};
      std::memcpy(&event, events.data() + at, sizeof event);
      const char* name = events.data() + at + sizeof event;
      if (event.len > 0 && path_.filename() == std::string_view(name)) seen = true;
      at += sizeof event + event.len;
    }
  }
  return seen;
}

}  // namespace rig::sim
