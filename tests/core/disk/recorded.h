// Everything that is written below a folder while this lives is recorded.
#pragma once

#include "tests/core/disk/disk_image.h"
#include "tests/core/disk/operation_log.h"
#include "tests/core/disk/recording_disk.h"
#include "tests/core/disk/recording_vfs.h"

namespace rig::test {

struct Recorded {
  explicit Recorded(const std::filesystem::path& root) : before(root), log(root), disk(log), vfs(log) {}

  /// What the disk may hold after the first `n` operations.
  [[nodiscard]] DiskImage image_after(std::size_t n) const {
    DiskImage image = before;
    for (std::size_t i = 0; i < n; ++i) image.apply(log.operations()[i]);
    return image;
  }

  DiskImage before;
  OperationLog log;
  RecordingDisk disk;
  RecordingVfs vfs;
};

}  // namespace rig::test
