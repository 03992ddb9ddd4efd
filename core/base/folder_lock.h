// One owner of a folder at a time.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/result.h"

namespace rig::base {

/// The lock of a folder, held by a file in it. It goes with the process, however that ends.
class FolderLock {
 public:
  /// What is said where another process has the lock.
  struct Taken {
    std::string what;
    std::string hint;
  };
  /// Makes the folder if needed. Busy, as `taken` says, where another process has it for longer than a
  /// second; io where the folder or the file cannot be made.
  [[nodiscard]] static Result<FolderLock> take(const std::filesystem::path& folder, const char* file,
                                               const Taken& taken);
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;
  ~FolderLock();

 private:
  explicit FolderLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace rig::base
