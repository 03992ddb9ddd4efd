#include "core/scan/verify.h"

#include <set>

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

constexpr const char* kRetake = "the pose has to be taken again";

}  // namespace

Result<Frame> read_recorded_frame(const fs::path& scan, std::int64_t row, const FrameRecord& record) {
  const fs::path path = scan / record.file;
  if (!fs::exists(path)) return fail(ErrorCode::not_found, "is missing", record.file, kRetake);
  const auto content = base::read_file(path);
  if (!content) return pass(content);
  const auto bytes = std::as_bytes(std::span(*content));
  const std::string hash = base::sha256_hex(bytes);
  if (hash != record.sha256) {
    return fail(
        ErrorCode::damaged,
        fmt::format("its content changed since it was taken: SHA-256 {} instead of {}", hash, record.sha256),
        record.file, kRetake);
  }
  auto frame = decode_frame(bytes, path.string());
  if (!frame) return frame;
  const FrameFacts& facts = frame->facts;
  if (facts.row != row || facts.index != record.index) {
    return fail(ErrorCode::damaged,
                fmt::format("says it is frame {} of row {}, the journal says {} of {}", facts.index,
                            facts.row, record.index, row),
                record.file, kRetake);
  }
  return frame;
}

Result<VerifyReport> verify_scan(const fs::path& scan, const std::function<void(std::size_t)>& on_frame) {
  auto view = open_scan(scan);
  if (!view) return pass(view);
  VerifyReport report;
  std::size_t left = 0;
  for (const PlanRow& row : view->plan) {
    ++report.progress.total;
    if (row.state == RowState::done) ++report.progress.done;
    if (row.state == RowState::abandoned) ++report.progress.abandoned;
  }
  if (report.progress.total != static_cast<std::int64_t>(view->job.poses.size())) {
    report.problems.push_back(fmt::format("the journal plans {} poses, job.toml {}", report.progress.total,
                                          view->job.poses.size()));
  }
  if (static_cast<std::int64_t>(view->poses.size()) != report.progress.done) {
    report.problems.push_back("the journal marks poses as done that it has no record of");
  }
  std::set<fs::path> named;
  for (const PoseRecord& pose : view->poses) left += pose.frames.size();
  for (const PoseRecord& pose : view->poses) {
    if (pose.frames.empty())
      report.problems.push_back(fmt::format("row {}: is done without a frame", pose.row));
    for (const FrameRecord& record : pose.frames) {
      if (base::interrupted()) return base::interrupted_error("nothing was changed; verify again");
      named.insert((scan / record.file).lexically_normal());
      std::error_code missing_is_told_below;
      const auto size = fs::file_size(scan / record.file, missing_is_told_below);
      if (!missing_is_told_below) report.bytes_checked += size;
      if (auto frame = read_recorded_frame(scan, pose.row, record); !frame) {
        report.problems.push_back(frame.error().text());
      }
      ++report.frames_checked;
      --left;
      if (on_frame) on_frame(left);
    }
  }
  const auto journal = Journal::open_read_only(journal_path(scan));
  if (!journal) return pass(journal);
  const auto visits = journal->visits();
  if (!visits) return pass(visits);
  for (const VisitRecord& visit : *visits) {
    for (const LookRecord& look : visit.looks) {
      const auto hash = base::sha256_of_file(scan / look.file);
      if (!hash) {
        report.problems.push_back(hash.error().text());
      } else if (*hash != look.sha256) {
        report.problems.push_back(fmt::format("{}: its content changed since it was taken", look.file));
      }
    }
  }
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(scan / "frames", error)) {
    const fs::path path = entry.path().lexically_normal();
    if (entry.is_regular_file() && named.count(path) == 0) {
      report.problems.push_back(
          fmt::format("{}: no pose of the journal has this file (a partial bracket is removed "
                      "when rigd resumes the job)",
                      fs::relative(path, scan).string()));
    }
  }
  if (error) report.problems.push_back(fmt::format("frames: cannot be listed: {}", error.message()));
  return report;
}

}  // namespace rig::scan
