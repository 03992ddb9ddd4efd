#include "core/base/folder_lock.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <thread>
#include <unistd.h>
#include <utility>

namespace rig::base {

namespace {

constexpr std::chrono::milliseconds kPatience{1000}, kLookAgain{5};

}  // namespace

Result<FolderLock> FolderLock::take(const std::filesystem::path& folder, const char* file,
                                    const Taken& taken) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    return fail(ErrorCode::io, fmt::format("cannot make the folder: {}", error.message()), folder.string());
  const std::filesystem::path path = folder / file;
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0)
    return fail(ErrorCode::io, fmt::format("cannot make the lock: {}", std::strerror(errno)), path.string());
  FolderLock lock(fd);
  // A process that was killed while it started another leaves its lock to that one until it runs its own
  // program.
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (std::chrono::steady_clock::now() >= end)
      return fail(ErrorCode::busy, taken.what, folder.string(), taken.hint);
    std::this_thread::sleep_for(kLookAgain);
  }
  return lock;
}

FolderLock::FolderLock(FolderLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

FolderLock::~FolderLock() {
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace rig::base
