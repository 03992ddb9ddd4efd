// The few operations by which this project's files get onto a disk. The real ones are the system's; tests put
// others in their place, which record what is done or refuse it.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace rig::base {

/// Each operation does what the system call of its kind does and reports as that does: -1 (0 bytes are no
/// error of write) with the reason in errno. May be called from several threads.
class Disk {
 public:
  virtual ~Disk() = default;

  /// Opens a file for writing, made if it is not there and emptied if it is; its descriptor.
  [[nodiscard]] virtual int create_file(const char* path) = 0;
  /// Appends; how many bytes, which may be fewer than asked.
  [[nodiscard]] virtual std::ptrdiff_t write(int file, std::span<const std::byte> bytes) = 0;
  /// Returns when the content is on the medium.
  [[nodiscard]] virtual int flush(int file) = 0;
  virtual int close(int file) = 0;
  /// Returns when the entries of a folder are on the medium.
  [[nodiscard]] virtual int flush_folder(const char* path) = 0;
  /// renameat2 with these flags.
  [[nodiscard]] virtual int rename(const char* from, const char* to, unsigned int flags) = 0;
  [[nodiscard]] virtual int make_folder(const char* path) = 0;
  [[nodiscard]] virtual int remove_file(const char* path) = 0;
  /// An empty one.
  [[nodiscard]] virtual int remove_folder(const char* path) = 0;
};

/// The system's own.
[[nodiscard]] std::unique_ptr<Disk> make_system_disk();

/// The one in use: the system's unless another was put in its place.
[[nodiscard]] Disk& disk();

/// Puts `other` in the place of what was in use, which is returned; nullptr is the system's. For tests, while
/// no other thread writes.
Disk* use_disk(Disk* other);

}  // namespace rig::base
