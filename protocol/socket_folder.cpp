#include "protocol/socket_folder.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/un.h>
#include <unistd.h>
#include <utility>

namespace rig::protocol {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::Result;

Result<SocketFolder> SocketFolder::take(const fs::path& folder) {
  std::error_code error;
  const fs::path absolute = fs::absolute(folder, error);
  fs::create_directories(absolute, error);
  if (error) {
    return fail(ErrorCode::io, fmt::format("cannot make the folder: {}", error.message()), absolute.string());
  }
  const fs::path lock_file = absolute / "server.lock";
  const int lock = ::open(lock_file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock < 0) {
    return fail(ErrorCode::io, fmt::format("cannot make the lock: {}", std::strerror(errno)),
                lock_file.string());
  }
  SocketFolder taken(absolute, lock);
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0) {
    return fail(ErrorCode::busy, "another rigd listens here", absolute.string(),
                "stop it, or choose another --runtime");
  }
  return taken;
}

SocketFolder::SocketFolder(SocketFolder&& other) noexcept
    : folder_(std::move(other.folder_)), lock_(std::exchange(other.lock_, -1)) {}

SocketFolder::~SocketFolder() {
  if (lock_ >= 0) ::close(lock_);
}

Result<fs::path> SocketFolder::make_way(const char* file) const {
  const fs::path path = folder_ / file;
  constexpr std::size_t kLongestPath = sizeof(sockaddr_un::sun_path) - 1;
  if (path.string().size() > kLongestPath) {
    return fail(ErrorCode::bad_input,
                fmt::format("the path of a socket may have at most {} letters", kLongestPath), path.string(),
                "choose a shorter --runtime folder");
  }
  std::error_code error;
  const fs::file_status there = fs::symlink_status(path, error);
  if (there.type() == fs::file_type::not_found) return path;
  if (there.type() != fs::file_type::socket) {
    return fail(ErrorCode::refused, "is no socket; it is not replaced", path.string(),
                "remove it, or choose another --runtime");
  }
  fs::remove(path, error);
  if (error) {
    return fail(ErrorCode::io, fmt::format("cannot remove an old socket: {}", error.message()),
                path.string());
  }
  return path;
}

}  // namespace rig::protocol
