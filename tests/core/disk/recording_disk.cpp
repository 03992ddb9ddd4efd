#include "tests/core/disk/recording_disk.h"

#include <cerrno>
#include <cstdio>

namespace rig::test {

using Kind = Operation::Kind;

RecordingDisk::RecordingDisk(OperationLog& log) : log_(log), before_(base::use_disk(this)) {}

RecordingDisk::~RecordingDisk() {
  base::use_disk(before_);
}

template <typename Do>
int RecordingDisk::recorded(Operation operation, Do&& carry_out) {
  if (const int error = log_.refused(operation); error != 0) {
    errno = error;
    return -1;
  }
  const int done = carry_out();
  if (done >= 0) log_.add(std::move(operation));
  return done;
}

int RecordingDisk::create_file(const char* path) {
  if (!log_.concerns(path)) return system_->create_file(path);
  const Open opened{log_.new_file(), 0};
  const int file = recorded({Kind::open, log_.relative(path), {}, opened.number, 0, {}},
                            [&] { return system_->create_file(path); });
  if (file < 0) return file;
  log_.add({Kind::truncate, log_.relative(path), {}, opened.number, 0, {}});
  const std::lock_guard lock(mutex_);
  open_[file] = opened;
  return file;
}

std::ptrdiff_t RecordingDisk::write(int file, std::span<const std::byte> bytes) {
  const std::lock_guard lock(mutex_);
  const auto found = open_.find(file);
  if (found == open_.end()) return system_->write(file, bytes);
  Open& open = found->second;
  Operation operation{Kind::write, {}, {}, open.number, open.size, {}};
  const int error = log_.refused(operation);
  if (error != 0) bytes = bytes.first(bytes.size() / 2);
  const std::ptrdiff_t written = system_->write(file, bytes);
  if (written > 0) {
    operation.bytes.assign(reinterpret_cast<const char*>(bytes.data()), static_cast<std::size_t>(written));
    open.size += static_cast<std::uint64_t>(written);
    log_.add(std::move(operation));
  }
  if (error == 0) return written;
  errno = error;
  return -1;
}

int RecordingDisk::flush(int file) {
  const std::lock_guard lock(mutex_);
  const auto found = open_.find(file);
  if (found == open_.end()) return system_->flush(file);
  return recorded({Kind::flush, {}, {}, found->second.number, 0, {}}, [] { return 0; });
}

int RecordingDisk::close(int file) {
  const std::lock_guard lock(mutex_);
  open_.erase(file);
  return system_->close(file);
}

int RecordingDisk::flush_folder(const char* path) {
  if (!log_.concerns(path)) return system_->flush_folder(path);
  return recorded({Kind::flush_folder, log_.relative(path)}, [] { return 0; });
}

int RecordingDisk::rename(const char* from, const char* to, unsigned int flags) {
  if (!log_.concerns(from)) return system_->rename(from, to, flags);
  const Kind kind = (flags & RENAME_EXCHANGE) != 0 ? Kind::exchange : Kind::rename;
  return recorded({kind, log_.relative(from), log_.relative(to)},
                  [&] { return system_->rename(from, to, flags); });
}

int RecordingDisk::make_folder(const char* path) {
  if (!log_.concerns(path)) return system_->make_folder(path);
  return recorded({Kind::make_folder, log_.relative(path)}, [&] { return system_->make_folder(path); });
}

int RecordingDisk::remove_file(const char* path) {
  if (!log_.concerns(path)) return system_->remove_file(path);
  return recorded({Kind::remove, log_.relative(path)}, [&] { return system_->remove_file(path); });
}

int RecordingDisk::remove_folder(const char* path) {
  if (!log_.concerns(path)) return system_->remove_folder(path);
  return recorded({Kind::remove, log_.relative(path)}, [&] { return system_->remove_folder(path); });
}

}  // namespace rig::test
