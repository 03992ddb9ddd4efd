#include "daemon/report_files.h"

#include <filesystem>

#include "core/base/files.h"
#include "core/scan/scan_directory.h"
#include "daemon/report.h"
#include "protocol/report_text.h"

namespace rig::daemon {

namespace fs = std::filesystem;
using base::pass;
using base::Result;

namespace {

constexpr std::size_t kMostEvents = 1000000;

Result<std::uint64_t> bytes_below(const fs::path& folder) {
  std::error_code error;
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder, error)) {
    std::error_code gone;  // a bracket that was just given back
    if (!entry.is_regular_file(gone)) continue;
    const auto size = entry.file_size(gone);
    if (!gone) bytes += size;
  }
  if (error) return base::fail(base::ErrorCode::io, error.message(), folder.string());
  return bytes;
}

}  // namespace

Result<protocol::Report> read_report(const protocol::JobInfo& job,
                                     const std::vector<scan::EventRecord>& kept) {
  const fs::path folder = job.scan_folder();
  const auto journal = scan::Journal::open_read_only(scan::journal_path(folder));
  if (!journal) return pass(journal);
  auto plan = journal->plan();
  if (!plan) return pass(plan);
  auto poses = journal->poses();
  if (!poses) return pass(poses);
  auto events = journal->events_after(0, 0, kMostEvents);
  if (!events) return pass(events);
  events->insert(events->end(), kept.begin(), kept.end());
  const auto visits = journal->visits();
  if (!visits) return pass(visits);
  auto report = make_report(job, *plan, *poses, *events, *visits);
  auto bytes = bytes_below(folder / "frames");
  if (!bytes) return pass(bytes);
  report.set_bytes_used(*bytes);
  return report;
}

Result<void> write_report(const protocol::Report& report) {
  const fs::path folder = report.job().scan_folder();
  const auto json = protocol::report_json(report);
  if (!json) return pass(json);
  if (auto ok = base::write_file_durably(folder / "report.json", *json); !ok) return ok;
  return base::write_file_durably(folder / "report.txt", protocol::report_text(report));
}

}  // namespace rig::daemon
