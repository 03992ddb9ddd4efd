// The folder in which a server's socket files stand. Private to protocol.
#pragma once

#include <filesystem>

#include "core/base/result.h"

namespace rig::protocol {

/// The right to listen in a folder. It goes with the process, so that a socket file without it is a
/// left-over.
class SocketFolder {
 public:
  /// Makes the folder if needed. Busy where another server has it.
  [[nodiscard]] static base::Result<SocketFolder> take(const std::filesystem::path& folder);
  SocketFolder(SocketFolder&& other) noexcept;
  SocketFolder& operator=(SocketFolder&&) = delete;
  ~SocketFolder();

  /// The path of a socket file, free to be bound: a left-over was removed. An Error where it is too long for
  /// a socket or something else stands there.
  [[nodiscard]] base::Result<std::filesystem::path> make_way(const char* file) const;

 private:
  SocketFolder(std::filesystem::path folder, int lock) : folder_(std::move(folder)), lock_(lock) {}
  std::filesystem::path folder_;
  int lock_;
};

}  // namespace rig::protocol
