#include "core/base/disk.h"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/death.h"

namespace rig::base {

namespace {

constexpr mode_t kFileMode = 0644;
constexpr mode_t kFolderMode = 0777;  // less the umask

class SystemDisk final : public Disk {
 public:
  int create_file(const char* path) override {
    return ::open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kFileMode);
  }
  std::ptrdiff_t write(int file, std::span<const std::byte> bytes) override {
    die_before(DurableStep::write);
    const std::ptrdiff_t done = ::write(file, bytes.data(), bytes.size());
    die_after(DurableStep::write);
    return done;
  }
  int flush(int file) override {
    die_before(DurableStep::flush);
    const int done = ::fsync(file);
    die_after(DurableStep::flush);
    return done;
  }
  int close(int file) override { return ::close(file); }
  int flush_folder(const char* path) override {
    const int folder = ::open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return -1;
    const int done = flush(folder);
    const int reason = errno;
    ::close(folder);
    errno = reason;
    return done;
  }
  int rename(const char* from, const char* to, unsigned int flags) override {
    die_before(DurableStep::rename);
    const int done = ::renameat2(AT_FDCWD, from, AT_FDCWD, to, flags);
    die_after(DurableStep::rename);
    return done;
  }
  int make_folder(const char* path) override { return ::mkdir(path, kFolderMode); }
  int remove_file(const char* path) override { return ::unlink(path); }
  int remove_folder(const char* path) override { return ::rmdir(path); }
};

std::atomic<Disk*>& other_disk() {
  static std::atomic<Disk*> other{nullptr};
  return other;
}

}  // namespace

std::unique_ptr<Disk> make_system_disk() {
  return std::make_unique<SystemDisk>();
}

Disk& disk() {
  static SystemDisk system;
  Disk* other = other_disk().load(std::memory_order_acquire);
  return other != nullptr ? *other : system;
}

Disk* use_disk(Disk* other) {
  return other_disk().exchange(other, std::memory_order_acq_rel);
}

}  // namespace rig::base
