// The system's disk with every operation below one folder recorded. Flushes are recorded instead of done:
// nothing that a test makes has to outlive it.
#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "core/base/disk.h"
#include "tests/core/disk/operation_log.h"

namespace rig::test {

/// In use from its making to its end. They may be nested.
class RecordingDisk final : public base::Disk {
 public:
  explicit RecordingDisk(OperationLog& log);
  ~RecordingDisk() override;
  RecordingDisk(const RecordingDisk&) = delete;
  RecordingDisk& operator=(const RecordingDisk&) = delete;

  int create_file(const char* path) override;
  std::ptrdiff_t write(int file, std::span<const std::byte> bytes) override;
  int flush(int file) override;
  int close(int file) override;
  int flush_folder(const char* path) override;
  int rename(const char* from, const char* to, unsigned int flags) override;
  int make_folder(const char* path) override;
  int remove_file(const char* path) override;
  int remove_folder(const char* path) override;

 private:
  struct Open {
    int number = 0;
    std::uint64_t size = 0;
  };
  template <typename Do>
  int recorded(Operation operation, Do&& carry_out);

  OperationLog& log_;
  base::Disk* before_;
  std::unique_ptr<base::Disk> system_ = base::make_system_disk();
  std::mutex mutex_;
  std::map<int, Open> open_;
};

}  // namespace rig::test
