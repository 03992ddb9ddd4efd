// SQLite's own file system layer with every operation below one folder recorded, as RecordingDisk does.
#pragma once

#include <memory>

#include "tests/core/disk/operation_log.h"

struct sqlite3_vfs;

namespace rig::test {

/// SQLite's default from its making to its end. Databases opened meanwhile must be closed before it ends.
class RecordingVfs {
 public:
  explicit RecordingVfs(OperationLog& log);
  ~RecordingVfs();
  RecordingVfs(const RecordingVfs&) = delete;
  RecordingVfs& operator=(const RecordingVfs&) = delete;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rig::test
