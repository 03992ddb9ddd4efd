// Stands for a disk without room: this process cannot make a file longer than a block.
#pragma once

#include <sys/resource.h>

namespace rig::sim {

/// A write beyond the limit fails in the whole process (EFBIG), in whatever file it is. The limit that was is
/// set again at the end.
class SizeLimit {
 public:
  SizeLimit();
  ~SizeLimit();
  SizeLimit(const SizeLimit&) = delete;
  SizeLimit& operator=(const SizeLimit&) = delete;

 private:
  rlimit before_{};
};

}  // namespace rig::sim
