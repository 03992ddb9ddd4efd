#include "core/base/files.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>
#include <sys/stat.h>
#include <utility>
#include <vector>

#include "core/base/disk.h"

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

class OpenFile {
 public:
  explicit OpenFile(const fs::path& path) : file_(disk().create_file(path.c_str())) {}
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (file_ >= 0) disk().close(file_);
  }
  [[nodiscard]] int get() const { return file_; }
  // Closes now, because a file system may report a lost write only here.
  [[nodiscard]] bool close() { return disk().close(std::exchange(file_, -1)) == 0; }

 private:
  int file_;
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
  OpenFile file(path);
  if (file.get() < 0) return system_failure("create", path, errno);
  while (!bytes.empty()) {
    const std::ptrdiff_t n = disk().write(file.get(), bytes);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_failure("write", path, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  if (disk().flush(file.get()) != 0) return system_failure("flush", path, errno);
  if (!file.close()) return system_failure("close", path, errno);
  return {};
}

Result<void> flush_folder(const fs::path& folder) {
  const fs::path path = folder.empty() ? fs::path(".") : folder;
  if (disk().flush_folder(path.c_str()) != 0) return system_failure("flush", path, errno);
  return {};
}

Result<void> make_folder_durably(const fs::path& folder) {
  const fs::path path = folder.has_filename() || folder.empty() ? folder : folder.parent_path();
  std::error_code error;
  if (path.empty() || fs::is_directory(path, error)) return {};
  if (auto made = make_folder_durably(path.parent_path()); !made) return made;
  // Made meanwhile by somebody else is as good, unless it is no folder.
  if (disk().make_folder(path.c_str()) != 0 && !(errno == EEXIST && fs::is_directory(path, error)))
    return system_failure("make the folder", path, errno);
  return flush_folder(path.parent_path());
}

Result<void> remove_tree(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(path, error);
  if (status.type() == fs::file_type::not_found) return {};
  if (error) return system_failure("remove", path, error.value());
  if (status.type() != fs::file_type::directory) {
    if (disk().remove_file(path.c_str()) != 0 && errno != ENOENT)
      return system_failure("remove", path, errno);
    return {};
  }
  std::vector<fs::path> inside;
  for (fs::directory_iterator entry(path, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    inside.push_back(entry->path());
  }
  if (error && error.value() != ENOENT) return system_failure("remove", path, error.value());
  std::sort(inside.begin(), inside.end());
  for (const fs::path& each : inside) {
    if (auto removed = remove_tree(each); !removed) return removed;
  }
  if (disk().remove_folder(path.c_str()) != 0 && errno != ENOENT)
    return system_failure("remove", path, errno);
  return {};
}

Result<bool> exchange_durably(const fs::path& from, const fs::path& to) {
  struct stat target {};
  const bool folder_in_the_way = ::stat(to.c_str(), &target) == 0 && S_ISDIR(target.st_mode);
  const unsigned int flags = folder_in_the_way ? RENAME_EXCHANGE : 0;
  if (disk().rename(from.c_str(), to.c_str(), flags) != 0) return system_failure("rename", from, errno);
  if (auto flushed = flush_folder(to.parent_path()); !flushed) return pass(flushed);
  if (from.parent_path() != to.parent_path()) {
    if (auto flushed = flush_folder(from.parent_path()); !flushed) return pass(flushed);
  }
  return folder_in_the_way;
}

Result<void> rename_durably(const fs::path& from, const fs::path& to) {
  const auto exchanged = exchange_durably(from, to);
  if (!exchanged) return pass(exchanged);
  return *exchanged ? remove_tree(from) : Result<void>();
}

Result<void> write_file_durably(const fs::path& path, std::span<const std::byte> bytes) {
  // A rename would exchange a folder in the way and remove it with all that is in it.
  if (std::error_code absent; fs::is_directory(path, absent)) {
    return fail(ErrorCode::refused, "is a folder; a file cannot take its place", path.string());
  }
  fs::path part = path;
  part += ".part";
  if (auto written = write_and_flush(part, bytes); !written) {
    (void)disk().remove_file(part.c_str());  // the first error is the one that matters
    return written;
  }
  return rename_durably(part, path);
}

Result<void> write_file_durably(const fs::path& path, std::string_view text) {
  return write_file_durably(path, std::as_bytes(std::span(text)));
}

}  // namespace rig::base
