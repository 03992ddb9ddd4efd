#include "core/scan/push.h"

#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <map>
#include <set>
#include <span>
#include <sys/file.h>
#include <unistd.h>

#include "core/base/files.h"
#include "core/base/hash.h"
#include "core/base/interrupt.h"
#include "core/scan/scan_directory.h"

namespace rig::scan {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr const char* kGoOn = "push again to go on with the next frame";

// Keeps a second push out of the same folder. Where the file system has no such locks there is none.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder)
      : file_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    taken_ = file_ < 0 || ::flock(file_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
  }
  ~FolderLock() {
    if (file_ >= 0) ::close(file_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  [[nodiscard]] bool taken() const { return taken_; }

 private:
  int file_;
  bool taken_ = false;
};

fs::path without_slash(const fs::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

bool is_inside(const fs::path& path, const fs::path& folder) {
  const std::string inside =
      fs::weakly_canonical(path).lexically_relative(fs::weakly_canonical(folder)).string();
  return !inside.empty() && inside.rfind("..", 0) != 0;
}

// Whether nothing is there but what a push leaves that was cut off at once.
bool is_free(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    if (entry->path().filename() != "rig.toml.part") return false;
  }
  return !error;
}

// The two files that a scan begins with; where they are there already they must be the same.
Result<void> bring_descriptions(const fs::path& scan, const fs::path& to) {
  std::error_code error;
  if (fs::exists(to, error) && !fs::exists(to / "rig.toml", error) && !is_free(to)) {
    return fail(ErrorCode::refused, "exists and is no earlier push of this scan", to.string(),
                "name another folder");
  }
  if (auto ok = base::make_folder_durably(to); !ok) return ok;
  for (const char* name : {"rig.toml", "job.toml"}) {
    const auto ours = base::read_file(scan / name);
    if (!ours) return pass(ours);
    if (!fs::exists(to / name, error)) {
      if (auto ok = base::write_file_durably(to / name, *ours); !ok) return ok;
      continue;
    }
    const auto theirs = base::read_file(to / name);
    if (!theirs) return pass(theirs);
    if (*theirs != *ours) {
      return fail(ErrorCode::refused, "is that of another scan", (to / name).string(), "name another folder");
    }
  }
  return base::make_folder_durably(to / "frames");
}

// A frame of a pose or of a reference visit, as the journal knows it.
struct StoredFile {
  std::string file;  // relative to the scan
  std::string sha256;
};

Result<std::vector<StoredFile>> files_of(const Journal& journal) {
  const auto poses = journal.poses();
  if (!poses) return pass(poses);
  const auto visits = journal.visits();
  if (!visits) return pass(visits);
  std::vector<StoredFile> files;
  for (const PoseRecord& pose : *poses) {
    for (const FrameRecord& frame : pose.frames) files.push_back({frame.file, frame.sha256});
  }
  for (const VisitRecord& visit : *visits) {
    for (const LookRecord& look : visit.looks) files.push_back({look.file, look.sha256});
  }
  return files;
}

// The journal at one moment.
struct Moment {
  std::string bytes;  // of the file
  ScanProgress progress;
  std::vector<StoredFile> files;
};

Result<Moment> read_moment(const Journal& journal, const fs::path& copy) {
  if (auto ok = journal.copy_to(copy); !ok) return pass(ok);
  const auto copied = Journal::open_read_only(copy);
  if (!copied) return pass(copied);
  const auto progress = copied->progress();
  if (!progress) return pass(progress);
  auto files = files_of(*copied);
  if (!files) return pass(files);
  auto bytes = base::read_file(copy);
  if (!bytes) return pass(bytes);
  return Moment{std::move(*bytes), *progress, std::move(*files)};
}

// By way of a copy, not from the journal itself, which may grow meanwhile; on a local disk, because SQLite
// trusts no other.
Result<Moment> moment_of(const Journal& journal) {
  std::string folder = (fs::temp_directory_path() / "rig-push-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr)
    return fail(ErrorCode::io, "cannot make a folder for a copy of the journal", folder);
  auto moment = read_moment(journal, fs::path(folder) / "journal.sqlite");
  if (auto ok = base::remove_tree(folder); !ok) return pass(ok);
  return moment;
}

using Hashes = std::map<std::string, std::string>;  // of a file relative to the scan

// What an earlier push brought to its end. Without a readable journal there, every file is hashed.
Hashes brought_before(const fs::path& to) {
  Hashes hashes;
  const auto journal = Journal::open_read_only(journal_path(to));
  if (!journal) return hashes;
  const auto files = files_of(*journal);
  if (!files) return hashes;
  for (const StoredFile& file : *files) hashes[file.file] = file.sha256;
  return hashes;
}

bool is_there(const fs::path& scan, const fs::path& to, const StoredFile& frame, const Hashes& before) {
  std::error_code error;
  const auto size = fs::file_size(to / frame.file, error);
  if (error) return false;
  const auto known = before.find(frame.file);
  if (known != before.end() && known->second == frame.sha256) {
    const auto expected = fs::file_size(scan / frame.file, error);
    return !error && size == expected;
  }
  const auto hash = base::sha256_of_file(to / frame.file);
  return hash && *hash == frame.sha256;
}

// So that what is read back comes from the medium, as far as the system lets one ask for that.
void forget_cached(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  ::close(file);
}

Result<void> copy_frame(const StoredFile& frame, const std::string& bytes, const fs::path& to) {
  const fs::path path = to / frame.file;
  if (auto ok = base::make_folder_durably(path.parent_path()); !ok) return ok;
  fs::path part = path;
  part += ".part";
  if (auto ok = base::write_and_flush(part, std::as_bytes(std::span(bytes))); !ok) return ok;
  forget_cached(part);
  const auto hash = base::sha256_of_file(part);
  if (!hash) return pass(hash);
  if (*hash != frame.sha256) {
    return fail(ErrorCode::damaged, "reads back otherwise than it was written", part.string(),
                "that disk or the way to it is not to be trusted");
  }
  return base::rename_durably(part, path);
}

// Removes what the pushed journal does not name: takes that were taken again or are to be.
Result<void> tidy_copy(const fs::path& to, const std::set<fs::path>& named) {
  std::error_code error;
  std::vector<fs::path> unknown;
  for (fs::recursive_directory_iterator entry(to / "frames", error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (entry->is_regular_file() && named.count(entry->path().lexically_normal()) == 0)
      unknown.push_back(entry->path());
  }
  if (error) return fail(ErrorCode::io, error.message(), (to / "frames").string());
  for (const fs::path& path : unknown) {
    if (auto ok = base::remove_tree(path); !ok) return ok;
    const fs::path folder = path.parent_path();
    if (folder == to / "frames" || !fs::is_empty(folder, error)) continue;
    if (auto ok = base::remove_tree(folder); !ok) return ok;
  }
  return {};
}

}  // namespace

Result<PushReport> push_scan(const fs::path& from, const fs::path& destination,
                             const std::function<void(std::size_t)>& on_frame) {
  const fs::path scan = without_slash(from);
  const fs::path to = without_slash(destination);
  std::error_code error;
  if (!fs::is_directory(scan, error))
    return fail(ErrorCode::not_found, "there is no such scan folder", scan.string());
  if (is_inside(to, scan)) {
    return fail(ErrorCode::refused, "lies in the scan itself", to.string(), "name a folder elsewhere");
  }
  const auto journal = Journal::open_read_only(journal_path(scan));
  if (!journal) return pass(journal);
  if (auto ok = bring_descriptions(scan, to); !ok) return pass(ok);
  const FolderLock lock(to);
  if (!lock.taken())
    return fail(ErrorCode::busy, "another push is writing to it", to.string(), "let that one end");

  const auto moment = moment_of(*journal);
  if (!moment) return pass(moment);
  PushReport report;
  report.progress = moment->progress;
  const Hashes before = brought_before(to);
  std::set<fs::path> named;
  std::vector<const StoredFile*> to_copy;
  for (const StoredFile& frame : moment->files) {
    if (base::interrupted()) return base::interrupted_error(kGoOn);
    named.insert((to / frame.file).lexically_normal());
    if (is_there(scan, to, frame, before)) {
      ++report.frames_there;
    } else {
      to_copy.push_back(&frame);
    }
  }
  std::size_t left = to_copy.size();
  for (const StoredFile* frame : to_copy) {
    if (base::interrupted()) return base::interrupted_error(kGoOn);
    const auto bytes = base::read_file(scan / frame->file);
    if (!bytes || base::sha256_hex(std::as_bytes(std::span(*bytes))) != frame->sha256) {
      report.problems.push_back(
          fmt::format("{}: {}; it is not copied", frame->file,
                      bytes ? "its content changed since it was taken" : bytes.error().what));
    } else {
      if (auto ok = copy_frame(*frame, *bytes, to); !ok) return pass(ok);
      ++report.frames_copied;
      report.bytes_copied += bytes->size();
    }
    --left;
    if (on_frame) on_frame(left);
  }
  const auto there = base::read_file(journal_path(to));
  if (!there || *there != moment->bytes) {
    if (auto ok = base::write_file_durably(journal_path(to), moment->bytes); !ok) return pass(ok);
  }
  if (auto ok = tidy_copy(to, named); !ok) return pass(ok);
  return report;
}

Result<PushReport> follow_scan(const fs::path& scan, const fs::path& to,
                               const std::function<void(std::size_t)>& on_frame,
                               const std::function<bool(const PushReport&)>& wait) {
  PushReport sum;
  while (true) {
    auto report = push_scan(scan, to, on_frame);
    if (!report) return report;
    report->frames_copied += sum.frames_copied;
    report->bytes_copied += sum.bytes_copied;
    sum = std::move(*report);
    const bool nothing_pending = sum.progress.done + sum.progress.abandoned == sum.progress.total;
    if (nothing_pending || !wait(sum)) return sum;
  }
}

}  // namespace rig::scan
