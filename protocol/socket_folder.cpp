#include "protocol/socket_folder.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <grp.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace rig::protocol {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

Result<gid_t> group_named(const std::string& name) {
  std::array<char, 65536> room{};
  group entry{};
  group* found = nullptr;
  if (::getgrnam_r(name.c_str(), &entry, room.data(), room.size(), &found) != 0 || found == nullptr) {
    return fail(ErrorCode::not_found, fmt::format("there is no group '{}' on this system", name), {},
                fmt::format("addgroup --system {}", name));
  }
  return entry.gr_gid;
}

}  // namespace

Result<SocketFolder> SocketFolder::take(const fs::path& folder) {
  std::error_code error;
  const fs::path absolute = fs::absolute(folder, error);
  auto lock = base::FolderLock::take(absolute, "server.lock",
                                     {"another rigd listens here", "stop it, or choose another --runtime"});
  if (!lock) return base::pass(lock);
  return SocketFolder(absolute, std::move(*lock));
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

Result<void> give_to_group(const fs::path& socket, const std::string& group) {
  std::error_code already_gone;
  auto gid = static_cast<gid_t>(-1);  // left as it is
  if (!group.empty()) {
    const auto found = group_named(group);
    if (!found) {
      fs::remove(socket, already_gone);
      return base::pass(found);
    }
    gid = *found;
  }
  if (::chown(socket.c_str(), static_cast<uid_t>(-1), gid) == 0 && ::chmod(socket.c_str(), 0660) == 0)
    return {};
  const int error = errno;
  fs::remove(socket, already_gone);
  return fail(ErrorCode::io, fmt::format("cannot give the socket to its group: {}", std::strerror(error)),
              socket.string(),
              group.empty() ? "" : fmt::format("rigd's user must be in the group '{}'", group));
}

}  // namespace rig::protocol
