// One owner of the rig at a time: rigd, or rigd-safe while it is at work.
#pragma once

#include <filesystem>

#include "core/base/result.h"

namespace rig::daemon {

/// The lock of a state folder. It goes with the process.
class FolderLock {
 public:
  /// Makes the folder if needed. Busy where another process has it.
  [[nodiscard]] static base::Result<FolderLock> take(const std::filesystem::path& folder);
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;
  ~FolderLock();

 private:
  explicit FolderLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace rig::daemon
