#include "core/scan/scan_directory.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <linux/magic.h>
#include <set>
#include <sys/vfs.h>
#include <unistd.h>

#include "core/base/files.h"
#include "core/base/hash.h"

namespace rig::scan {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

constexpr const char* kPartSuffix = ".part";

Result<void> system_result(const std::error_code& error, std::string_view doing, const fs::path& path) {
  if (!error) return {};
  return fail(ErrorCode::io, fmt::format("cannot {}: {}", doing, error.message()), path.string());
}

// A retake that was published and never committed: the take that the journal knows lies beside it.
Result<void> undo_retake(const fs::path& scan, const Journal& journal, std::int64_t row) {
  const fs::path part = part_folder(scan, row);
  std::error_code error;
  if (!fs::is_directory(part, error)) return {};
  const auto pose = journal.pose(row);
  if (!pose) return pass(pose);
  if (!*pose || holds_bracket(frames_folder(scan, row), **pose) || !holds_bracket(part, **pose)) return {};
  const auto exchanged = base::exchange_durably(part, frames_folder(scan, row));
  if (!exchanged) return pass(exchanged);
  return {};
}

// Removes a scan that could not be made whole.
class Undo {
 public:
  explicit Undo(fs::path folder) : folder_(std::move(folder)) {}
  Undo(const Undo&) = delete;
  Undo& operator=(const Undo&) = delete;
  ~Undo() {
    if (folder_.empty()) return;
    (void)base::remove_tree(folder_);  // why the scan could not be made is what its caller hears
  }
  void keep() { folder_.clear(); }

 private:
  fs::path folder_;
};

}  // namespace

bool is_network_file_system(unsigned long magic) {
  constexpr std::array<unsigned long, 8> kNetwork{NFS_SUPER_MAGIC,  SMB_SUPER_MAGIC, CIFS_SUPER_MAGIC,
                                                  SMB2_SUPER_MAGIC, AFS_SUPER_MAGIC, AFS_FS_MAGIC,
                                                  CEPH_SUPER_MAGIC, FUSE_SUPER_MAGIC};
  return std::find(kNetwork.begin(), kNetwork.end(), magic) != kNetwork.end();
}

Result<void> refuse_network_disk(const fs::path& folder) {
  struct statfs info {};
  if (::statfs(folder.c_str(), &info) != 0) return {};
  // The type is signed on some machines; the numbers are of 32 bits.
  if (!is_network_file_system(static_cast<unsigned long>(info.f_type) & 0xFFFFFFFFUL)) return {};
  return fail(ErrorCode::refused, "lies on a network file system, where a journal is not safe",
              folder.string(), "scan to a local disk and copy the finished scan");
}

fs::path journal_path(const fs::path& scan) {
  return scan / "journal.sqlite";
}

fs::path frames_folder(const fs::path& scan, std::int64_t row) {
  return scan / "frames" / fmt::format("{:06}", row);
}

fs::path part_folder(const fs::path& scan, std::int64_t row) {
  fs::path path = frames_folder(scan, row);
  path += kPartSuffix;
  return path;
}

std::string frame_name(int index) {
  return fmt::format("{:02}.tif", index);
}

Result<void> create_scan(const fs::path& where, const std::string& rig_toml, const std::string& job_toml) {
  // "scan/" has no file name, but means the same folder.
  const fs::path scan = where.has_filename() ? where : where.parent_path();
  auto rig = machine::parse_rig_config(rig_toml, "rig.toml");
  if (!rig) return pass(rig);
  auto job = machine::parse_job_config(job_toml, "job.toml");
  if (!job) return pass(job);
  std::error_code error;
  if (fs::exists(scan, error) && !(fs::is_directory(scan, error) && fs::is_empty(scan, error))) {
    return fail(ErrorCode::refused, "exists and is not empty", scan.string(),
                "name a new folder for the scan");
  }
  const fs::path parent = scan.parent_path().empty() ? fs::path(".") : scan.parent_path();
  if (auto ok = base::make_folder_durably(parent); !ok) return ok;
  if (auto ok = refuse_network_disk(parent); !ok) return ok;
  // Made beside its place and renamed, so that a scan is there whole or not at all.
  const fs::path making = parent / fmt::format(".{}.{}.part", scan.filename().string(), ::getpid());
  if (auto ok = base::remove_tree(making); !ok) return ok;
  Undo undo(making);
  if (auto ok = base::make_folder_durably(making / "frames"); !ok) return ok;
  const auto bytes = [](const std::string& text) { return std::as_bytes(std::span(text)); };
  if (auto ok = base::write_and_flush(making / "rig.toml", bytes(rig_toml)); !ok) return ok;
  if (auto ok = base::write_and_flush(making / "job.toml", bytes(job_toml)); !ok) return ok;
  {
    auto journal = Journal::create(journal_path(making), job->poses);
    if (!journal) return pass(journal);
  }
  if (auto ok = base::flush_folder(making); !ok) return ok;
  if (auto ok = base::rename_durably(making, scan); !ok) return ok;
  undo.keep();
  return {};
}

Result<ScanView> open_scan(const fs::path& scan) {
  std::error_code error;
  if (!fs::is_directory(scan, error))
    return fail(ErrorCode::not_found, "there is no such scan folder", scan.string());
  ScanView view;
  view.folder = scan;
  auto rig = machine::load_rig_config((scan / "rig.toml").string());
  if (!rig) return pass(rig);
  auto job = machine::load_job_config((scan / "job.toml").string());
  if (!job) return pass(job);
  auto journal = Journal::open_read_only(journal_path(scan));
  if (!journal) return pass(journal);
  auto poses = journal->poses();
  if (!poses) return pass(poses);
  auto plan = journal->plan();
  if (!plan) return pass(plan);
  view.rig = std::move(*rig);
  view.job = std::move(*job);
  view.poses = std::move(*poses);
  view.plan = std::move(*plan);
  return view;
}

Result<std::string> store_frame(const fs::path& scan, const FrameFacts& facts, int width, int height,
                                const std::uint16_t* pixels) {
  auto bytes = encode_frame(facts, width, height, pixels);
  if (!bytes) return pass(bytes);
  const fs::path folder = part_folder(scan, facts.row);
  if (auto ok = base::make_folder_durably(folder); !ok) return pass(ok);
  if (auto ok = base::write_and_flush(folder / frame_name(facts.index), *bytes); !ok) return pass(ok);
  return base::sha256_hex(*bytes);
}

Result<void> publish_bracket(const fs::path& scan, std::int64_t row) {
  const fs::path part = part_folder(scan, row);
  if (auto ok = base::flush_folder(part); !ok) return ok;
  const auto published = base::exchange_durably(part, frames_folder(scan, row));
  if (!published) return pass(published);
  return {};
}

Result<void> discard_bracket(const fs::path& scan, std::int64_t row) {
  return base::remove_tree(part_folder(scan, row));
}

bool holds_bracket(const fs::path& folder, const PoseRecord& pose) {
  return std::all_of(pose.frames.begin(), pose.frames.end(), [&folder](const FrameRecord& frame) {
    const auto hash = base::sha256_of_file(folder / frame_name(frame.index));
    return hash && *hash == frame.sha256;
  });
}

Result<void> tidy_scan(const fs::path& scan, const Journal& journal) {
  auto plan = journal.plan();
  if (!plan) return pass(plan);
  std::set<std::string> known;
  for (const PlanRow& row : *plan) {
    if (row.state != RowState::done) continue;
    known.insert(frames_folder(scan, row.row).filename().string());
    if (auto ok = undo_retake(scan, journal, row.row); !ok) return ok;
  }
  std::error_code error;
  const fs::path frames = scan / "frames";
  std::vector<fs::path> unknown;
  for (const auto& entry : fs::directory_iterator(frames, error)) {
    if (known.count(entry.path().filename().string()) == 0) unknown.push_back(entry.path());
  }
  if (auto ok = system_result(error, "read the folder", frames); !ok) return ok;
  const auto visits = journal.visits();
  if (!visits) return pass(visits);
  std::set<fs::path> visited;
  for (const VisitRecord& visit : *visits) visited.insert(visit_folder(scan, visit.number));
  const fs::path references = scan / "references";
  for (const auto& entry : fs::directory_iterator(references, error)) {
    if (visited.count(entry.path()) == 0) unknown.push_back(entry.path());
  }
  std::sort(unknown.begin(), unknown.end());
  for (const fs::path& path : unknown) {
    if (auto ok = base::remove_tree(path); !ok) return ok;
  }
  return base::flush_folder(frames);
}

}  // namespace rig::scan
