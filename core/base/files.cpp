#include "core/base/files.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <sstream>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/death.h"

namespace rig::base {

namespace fs = std::filesystem;

namespace {

tl::unexpected<Error> system_failure(std::string_view doing, const fs::path& path, int error) {
  const ErrorCode code = error == ENOENT ? ErrorCode::not_found : ErrorCode::io;
  std::string hint;
  if (error == ENOSPC) hint = "free space on that file system";
  if (error == EACCES || error == EPERM) hint = "check the owner and the permissions";
  if (error == EROFS) hint = "the file system is read-only";
  return fail(code, fmt::format("cannot {}: {}", doing, std::strerror(error)), path.string(), hint);
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const { return fd_; }
  // Closes now, because a file system may report a lost write only here.
  [[nodiscard]] bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

}  // namespace

Result<std::string> read_file(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error))
    return fail(ErrorCode::bad_input, "is a folder, not a file", path.string());
  std::ifstream in(path, std::ios::binary);
  if (!in) return system_failure("open", path, errno);
  std::ostringstream out;
  out << in.rdbuf();
  if (in.bad()) return system_failure("read", path, errno);
  return std::move(out).str();
}

Result<void> write_and_flush(const fs::path& path, std::span<const std::byte> bytes) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (file.get() < 0) return system_failure("create", path, errno);
  die_before(DurableStep::write);
  while (!bytes.empty()) {
    const ssize_t n = ::write(file.get(), bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_failure("write", path, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  die_after(DurableStep::write);
  die_before(DurableStep::flush);
  if (::fsync(file.get()) != 0) return system_failure("flush", path, errno);
  die_after(DurableStep::flush);
  if (!file.close()) return system_failure("close", path, errno);
  return {};
}

Result<void> flush_folder(const fs::path& folder) {
  const fs::path path = folder.empty() ? fs::path(".") : folder;
  const Descriptor dir(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (dir.get() < 0) return system_failure("open", path, errno);
  die_before(DurableStep::flush);
  if (::fsync(dir.get()) != 0) return system_failure("flush", path, errno);
  die_after(DurableStep::flush);
  return {};
}

Result<void> rename_durably(const fs::path& from, const fs::path& to) {
  struct stat target {};
  const bool folder_in_the_way = ::stat(to.c_str(), &target) == 0 && S_ISDIR(target.st_mode);
  const unsigned int flags = folder_in_the_way ? RENAME_EXCHANGE : 0;
  die_before(DurableStep::rename);
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flags) != 0)
    return system_failure("rename", from, errno);
  die_after(DurableStep::rename);
  if (auto flushed = flush_folder(to.parent_path()); !flushed) return flushed;
  if (from.parent_path() != to.parent_path()) {
    if (auto flushed = flush_folder(from.parent_path()); !flushed) return flushed;
  }
  if (folder_in_the_way) {
    std::error_code error;
    fs::remove_all(from, error);
    if (error) return system_failure("remove the replaced folder", from, error.value());
  }
  return {};
}

Result<void> write_file_durably(const fs::path& path, std::span<const std::byte> bytes) {
  // A rename would exchange a folder in the way and remove it with all that is in it.
  if (std::error_code absent; fs::is_directory(path, absent)) {
    return fail(ErrorCode::refused, "is a folder; a file cannot take its place", path.string());
  }
  fs::path part = path;
  part += ".part";
  if (auto written = write_and_flush(part, bytes); !written) {
    std::error_code ignored;  // the first error is the one that matters
    fs::remove(part, ignored);
    return written;
  }
  return rename_durably(part, path);
}

Result<void> write_file_durably(const fs::path& path, std::string_view text) {
  return write_file_durably(path, std::as_bytes(std::span(text)));
}

}  // namespace rig::base
