#include "tests/core/disk/recording_vfs.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <new>
#include <sqlite3.h>
#include <utility>

namespace rig::test {

namespace {

using Kind = Operation::Kind;

struct Vfs {
  sqlite3_vfs* system;
  OperationLog* log;
};

// Followed in memory by the file of the system's layer.
struct File {
  sqlite3_file base;
  sqlite3_io_methods methods;
  OperationLog* log;  // nullptr: not recorded
  int number;
  // SQLite flushes the folder of a journal that it made together with the journal's first flush.
  bool flush_folder;
  std::filesystem::path* path;
};

File& as_file(sqlite3_file* file) {
  return *reinterpret_cast<File*>(file);
}
sqlite3_file* system_file(sqlite3_file* file) {
  return reinterpret_cast<sqlite3_file*>(reinterpret_cast<char*>(file) + sizeof(File));
}
Vfs& as_vfs(sqlite3_vfs* vfs) {
  return *static_cast<Vfs*>(vfs->pAppData);
}

int close_file(sqlite3_file* file) {
  delete as_file(file).path;
  return system_file(file)->pMethods->xClose(system_file(file));
}
int read_file(sqlite3_file* file, void* out, int size, sqlite3_int64 offset) {
  return system_file(file)->pMethods->xRead(system_file(file), out, size, offset);
}
int write_file(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
  File& f = as_file(file);
  const auto* system = system_file(file)->pMethods;
  if (f.log == nullptr) return system->xWrite(system_file(file), data, size, offset);
  Operation operation{Kind::write, {}, {}, f.number, static_cast<std::uint64_t>(offset), {}};
  const bool refused = f.log->refused(operation) != 0;
  if (refused) size /= 2;
  const int done = system->xWrite(system_file(file), data, size, offset);
  if (done != SQLITE_OK) return done;
  operation.bytes.assign(static_cast<const char*>(data), static_cast<std::size_t>(size));
  f.log->add(std::move(operation));
  return refused ? SQLITE_FULL : SQLITE_OK;
}
int truncate_file(sqlite3_file* file, sqlite3_int64 size) {
  File& f = as_file(file);
  if (f.log != nullptr) {
    Operation operation{Kind::truncate, {}, {}, f.number, static_cast<std::uint64_t>(size), {}};
    if (f.log->refused(operation) != 0) return SQLITE_IOERR_TRUNCATE;
    f.log->add(std::move(operation));
  }
  return system_file(file)->pMethods->xTruncate(system_file(file), size);
}
int sync_file(sqlite3_file* file, int flags) {
  File& f = as_file(file);
  if (f.log == nullptr) return system_file(file)->pMethods->xSync(system_file(file), flags);
  Operation operation{Kind::flush, {}, {}, f.number, 0, {}};
  if (f.log->refused(operation) != 0) return SQLITE_IOERR_FSYNC;
  f.log->add(std::move(operation));
  if (std::exchange(f.flush_folder, false)) {
    f.log->add({Kind::flush_folder, f.log->relative(f.path->parent_path())});
  }
  return SQLITE_OK;
}
int file_size(sqlite3_file* file, sqlite3_int64* size) {
  return system_file(file)->pMethods->xFileSize(system_file(file), size);
}
int lock(sqlite3_file* file, int level) {
  return system_file(file)->pMethods->xLock(system_file(file), level);
}
int unlock(sqlite3_file* file, int level) {
  return system_file(file)->pMethods->xUnlock(system_file(file), level);
}
int check_lock(sqlite3_file* file, int* out) {
  return system_file(file)->pMethods->xCheckReservedLock(system_file(file), out);
}
int control(sqlite3_file* file, int op, void* argument) {
  return system_file(file)->pMethods->xFileControl(system_file(file), op, argument);
}
int sector_size(sqlite3_file* file) {
  return system_file(file)->pMethods->xSectorSize(system_file(file));
}
int characteristics(sqlite3_file* file) {
  return system_file(file)->pMethods->xDeviceCharacteristics(system_file(file));
}
int shm_map(sqlite3_file* file, int page, int size, int extend, void volatile** out) {
  return system_file(file)->pMethods->xShmMap(system_file(file), page, size, extend, out);
}
int shm_lock(sqlite3_file* file, int offset, int n, int flags) {
  return system_file(file)->pMethods->xShmLock(system_file(file), offset, n, flags);
}
void shm_barrier(sqlite3_file* file) {
  system_file(file)->pMethods->xShmBarrier(system_file(file));
}
int shm_unmap(sqlite3_file* file, int remove) {
  return system_file(file)->pMethods->xShmUnmap(system_file(file), remove);
}

int open_file(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  Vfs& v = as_vfs(vfs);
  const bool concerns = name != nullptr && v.log->concerns(name);
  const bool exists = concerns && std::filesystem::exists(name);
  auto& f = *new (file) File{};
  Operation operation{Kind::open, concerns ? v.log->relative(name) : std::string(), {}, 0, 0, {}};
  if (concerns && !exists && v.log->refused(operation) != 0) return SQLITE_CANTOPEN;
  const int done = v.system->xOpen(v.system, name, system_file(file), flags, out_flags);
  if (done != SQLITE_OK) return done;
  f.methods = sqlite3_io_methods{
      2,         &close_file,  &read_file,  &write_file, &truncate_file, &sync_file,       &file_size,
      &lock,     &unlock,      &check_lock, &control,    &sector_size,   &characteristics, &shm_map,
      &shm_lock, &shm_barrier, &shm_unmap,  nullptr,     nullptr};
  f.base.pMethods = &f.methods;
  if (!concerns) return done;
  f.log = v.log;
  f.path = new std::filesystem::path(name);
  f.number = operation.file = v.log->new_file();
  f.flush_folder = !exists && (flags & (SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL)) != 0;
  v.log->add(std::move(operation));
  return done;
}

int delete_file(sqlite3_vfs* vfs, const char* name, int flush_folder) {
  Vfs& v = as_vfs(vfs);
  if (!v.log->concerns(name)) return v.system->xDelete(v.system, name, flush_folder);
  Operation operation{Kind::remove, v.log->relative(name)};
  if (v.log->refused(operation) != 0) return SQLITE_IOERR_DELETE;
  const int done = v.system->xDelete(v.system, name, 0);
  if (done != SQLITE_OK) return done;
  v.log->add(std::move(operation));
  if (flush_folder != 0) {
    v.log->add({Kind::flush_folder, v.log->relative(std::filesystem::path(name).parent_path())});
  }
  return done;
}

}  // namespace

struct RecordingVfs::State {
  Vfs vfs{};
  sqlite3_vfs registered{};
};

RecordingVfs::RecordingVfs(OperationLog& log) : state_(std::make_unique<State>()) {
  sqlite3_vfs* system = sqlite3_vfs_find(nullptr);
  state_->vfs = {system, &log};
  sqlite3_vfs& own = state_->registered;
  own = *system;
  own.pNext = nullptr;
  own.zName = "recording";
  own.szOsFile = static_cast<int>(sizeof(File)) + system->szOsFile;
  own.xOpen = &open_file;
  own.xDelete = &delete_file;
  own.pAppData = &state_->vfs;
  sqlite3_vfs_register(&own, 1);
}

RecordingVfs::~RecordingVfs() {
  sqlite3_vfs_unregister(&state_->registered);
}

}  // namespace rig::test
