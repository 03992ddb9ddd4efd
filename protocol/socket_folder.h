// The folder in which a server's socket files stand. Private to protocol.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "core/base/folder_lock.h"
#include "core/base/result.h"

namespace rig::protocol {

/// The right to listen in a folder. It goes with the process, so that a socket file without it is a
/// left-over.
class SocketFolder {
 public:
  /// Makes the folder if needed. Busy where another server has it.
  [[nodiscard]] static base::Result<SocketFolder> take(const std::filesystem::path& folder);

  /// The path of a socket file, free to be bound: a left-over was removed. An Error where it is too long for
  /// a socket or something else stands there.
  [[nodiscard]] base::Result<std::filesystem::path> make_way(const char* file) const;

 private:
  SocketFolder(std::filesystem::path folder, base::FolderLock lock)
      : folder_(std::move(folder)), lock_(std::move(lock)) {}
  std::filesystem::path folder_;
  base::FolderLock lock_;
};

/// Lets the group connect to a socket that its owner alone may connect to; empty: the group of this process.
/// not_found for a group that is not there; the socket file is removed where it cannot be given.
[[nodiscard]] base::Result<void> give_to_group(const std::filesystem::path& socket, const std::string& group);

}  // namespace rig::protocol
