#include "core/scan/recover.h"

#include <algorithm>
#include <cmath>
#include <fcntl.h>
#include <unistd.h>

#include "core/base/files.h"
#include "core/base/hash.h"
#include "core/base/interrupt.h"
#include "core/base/units.h"
#include "core/machine/job_config.h"
#include "core/scan/salvage.h"
#include "core/scan/scan_directory.h"

namespace rig::scan {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

// Angles go through degrees in a frame's description.
constexpr double kSameAngle_rad = 1e-9;

fs::path beside(const fs::path& path, const std::string& ending) {
  fs::path out = path;
  out += ending;
  return out;
}

// SQLite's programs hold locks on the shared index of the log as long as they have the database open.
Result<void> refuse_if_open(const fs::path& journal) {
  const fs::path index = beside(journal, "-shm");
  const int file = ::open(index.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return {};
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  const bool known = ::fcntl(file, F_OFD_GETLK, &lock) == 0;
  ::close(file);
  if (!known || lock.l_type == F_UNLCK) return {};
  return fail(ErrorCode::busy, fmt::format("process {} has it open", lock.l_pid), journal.string(),
              "end that program first: rigd opens its active job's journal again at the next start");
}

Result<void> refuse_if_whole(const fs::path& journal) {
  std::error_code error;
  if (!fs::exists(journal, error)) return {};
  const auto opened = Journal::open_read_only(journal);
  if (opened) {
    return fail(ErrorCode::refused, "is whole: there is nothing to recover", journal.string(),
                "with --even-if-whole it is rebuilt all the same, where it is from an old copy, say");
  }
  return {};
}

// The frames of a row as its folder has them: whole, readable and of this row, or an Error that says what
// not.
Result<PoseRecord> read_bracket(const fs::path& scan, std::int64_t row, const machine::JobConfig& job) {
  const fs::path folder = frames_folder(scan, row);
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    return fail(ErrorCode::not_found, fs::is_directory(part_folder(scan, row), error)
                                          ? "its bracket was never complete"
                                          : "it has no frames");
  }
  PoseRecord pose;
  pose.row = row;
  pose.target_rad = job.poses[static_cast<std::size_t>(row)];
  for (int index = 0; fs::exists(folder / frame_name(index), error); ++index) {
    const fs::path path = folder / frame_name(index);
    const std::string name = fs::relative(path, scan).string();
    const auto frame = read_frame(path);
    if (!frame) return fail(frame.error().code, frame.error().what, name);
    const FrameFacts& facts = frame->facts;
    if (facts.row != row || facts.index != index) {
      return fail(ErrorCode::damaged, fmt::format("says it is frame {} of row {}", facts.index, facts.row),
                  name);
    }
    for (std::size_t axis = 0; axis < machine::kAxisCount; ++axis) {
      if (std::abs(facts.target_rad[axis] - pose.target_rad[axis]) <= kSameAngle_rad) continue;
      return fail(
          ErrorCode::damaged,
          fmt::format("was taken for {} at {:.4f} deg, job.toml has {:.4f} deg", machine::kAxisNames[axis],
                      base::degrees(facts.target_rad[axis]), base::degrees(pose.target_rad[axis])),
          name);
    }
    auto hash = base::sha256_of_file(path);
    if (!hash) return pass(hash);
    pose.readback_rad = facts.readback_rad;
    FrameRecord record;
    record.index = index;
    record.file = name;
    record.exposure_s = facts.exposure_s;
    record.gain = facts.gain;
    record.sha256 = std::move(*hash);
    pose.frames.push_back(std::move(record));
  }
  if (pose.frames.empty()) return fail(ErrorCode::not_found, "it has no frames");
  const std::size_t planned = job.exposure.exposures_s.size();
  if (job.exposure.strategy == machine::ExposureStrategy::fixed && pose.frames.size() != planned) {
    return fail(ErrorCode::damaged, fmt::format("has {} of {} frames", pose.frames.size(), planned));
  }
  return pose;
}

// What the old journal knows of the frames: times, and whether they are what was taken.
Result<bool> prove(PoseRecord& pose, const PoseRecord& old) {
  pose.attempt = old.attempt;
  pose.arrived = old.arrived;
  pose.committed = old.committed;
  std::size_t proven = 0;
  for (FrameRecord& frame : pose.frames) {
    const auto known = std::find_if(old.frames.begin(), old.frames.end(),
                                    [&](const FrameRecord& f) { return f.index == frame.index; });
    if (known == old.frames.end()) continue;
    if (known->sha256 != frame.sha256) {
      return fail(ErrorCode::damaged, "its content changed since it was taken", frame.file);
    }
    frame = *known;
    ++proven;
  }
  return proven == pose.frames.size();
}

// One row, judged and written into the new journal.
Result<RecoveredRow> recover_row(const fs::path& scan, std::int64_t row, const machine::JobConfig& job,
                                 const Salvage& salvage, Journal& journal) {
  RecoveredRow out;
  out.row = row;
  const auto line = salvage.rows.find(row);
  if (line != salvage.rows.end()) {
    const bool abandoned = line->second.state == RowState::abandoned;
    for (int i = 0; i < line->second.attempts; ++i) {
      const bool last = i + 1 == line->second.attempts;
      if (auto ok = journal.record_failure(row, line->second.reason, abandoned && last, {}); !ok)
        return pass(ok);
    }
    if (abandoned) {
      out.state = RowState::abandoned;
      out.reason = line->second.reason;
      return out;
    }
  }
  const auto old = salvage.poses.find(row);
  // A retake that was not committed lies in the place of the take that was.
  if (old != salvage.poses.end() && !old->second.frames.empty() &&
      holds_bracket(part_folder(scan, row), old->second) &&
      !holds_bracket(frames_folder(scan, row), old->second)) {
    if (auto ok = journal.commit_pose(old->second, {}); !ok) return pass(ok);
    out.state = RowState::done;
    out.frames = static_cast<int>(old->second.frames.size());
    out.proven = true;
    return out;
  }
  auto pose = read_bracket(scan, row, job);
  if (pose && old != salvage.poses.end()) {
    const auto proven = prove(*pose, old->second);
    if (!proven) {
      pose = pass(proven);
    } else {
      out.proven = *proven;
    }
  }
  if (!pose) {
    out.reason = pose.error().text();
    return out;
  }
  if (auto ok = journal.commit_pose(*pose, {}); !ok) return pass(ok);
  out.state = RowState::done;
  out.frames = static_cast<int>(pose->frames.size());
  return out;
}

// The frames of a visit that the old journal does not know; its verdict needs the rig's geometry and the
// visit it was compared with.
Result<VisitRecord> read_visit(const fs::path& scan, std::int64_t number) {
  VisitRecord visit;
  visit.number = number;
  visit.what = "its verdict was lost with the journal";
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(visit_folder(scan, number), error)) {
    const std::string name = fs::relative(entry.path(), scan).string();
    const auto frame = read_frame(entry.path());
    if (!frame) return fail(frame.error().code, frame.error().what, name);
    auto hash = base::sha256_of_file(entry.path());
    if (!hash) return pass(hash);
    visit.looks.push_back(
        {entry.path().stem().string(), name, frame->facts.exposure_s, {}, std::move(*hash), {}});
  }
  if (error) return fail(ErrorCode::io, error.message(), visit_folder(scan, number).string());
  if (visit.looks.empty()) return fail(ErrorCode::not_found, "it has no frames");
  std::sort(visit.looks.begin(), visit.looks.end(),
            [](const LookRecord& a, const LookRecord& b) { return a.name < b.name; });
  return visit;
}

// Whether every frame of a visit is what the old journal says was taken.
Result<void> prove_visit(const fs::path& scan, const VisitRecord& old) {
  for (const LookRecord& look : old.looks) {
    const auto hash = base::sha256_of_file(scan / look.file);
    if (!hash) return pass(hash);
    if (*hash != look.sha256) {
      return fail(ErrorCode::damaged, "its content changed since it was taken", look.file);
    }
  }
  return {};
}

// Folders of visits in references/, by number.
std::vector<std::int64_t> visits_on_disk(const fs::path& scan) {
  std::vector<std::int64_t> numbers;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(visit_folder(scan, 0).parent_path(), none)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") == std::string::npos) numbers.push_back(std::stoll(name));
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

Result<std::vector<RecoveredVisit>> recover_visits(const fs::path& scan, const Salvage& salvage,
                                                   Journal& journal) {
  std::vector<RecoveredVisit> out;
  for (const std::int64_t number : visits_on_disk(scan)) {
    RecoveredVisit recovered{number, 0, false, {}};
    const auto old = std::find_if(salvage.visits.begin(), salvage.visits.end(),
                                  [&](const VisitRecord& v) { return v.number == number; });
    recovered.judged = old != salvage.visits.end();
    Result<VisitRecord> visit = recovered.judged ? Result<VisitRecord>(*old) : read_visit(scan, number);
    if (recovered.judged) {
      if (auto proven = prove_visit(scan, *old); !proven) visit = pass(proven);
    }
    if (visit) {
      recovered.frames = static_cast<int>(visit->looks.size());
      if (auto ok = journal.record_visit(*visit, Retake::none, {}); !ok) return pass(ok);
    } else {
      recovered.reason = visit.error().text();
    }
    out.push_back(std::move(recovered));
  }
  return out;
}

// Copies the old journal and its log to a name that is free. The old log must be gone before the new journal
// is in its place: SQLite would play it back into that.
Result<fs::path> set_aside(const fs::path& journal) {
  std::error_code error;
  fs::path kept;
  for (int n = 1; kept.empty(); ++n) {
    const fs::path name = beside(journal, fmt::format(".old-{}", n));
    if (!fs::exists(name, error) && !fs::exists(beside(name, "-wal"), error)) kept = name;
  }
  bool any = false;
  for (const char* ending : {"", "-wal"}) {
    if (!fs::exists(beside(journal, ending), error)) continue;
    const auto bytes = base::read_file(beside(journal, ending));
    if (!bytes) return pass(bytes);
    if (bytes->empty()) continue;
    if (auto ok = base::write_file_durably(beside(kept, ending), *bytes); !ok) return pass(ok);
    any = true;
  }
  for (const char* ending : {"-wal", "-shm"}) {
    if (auto ok = base::remove_tree(beside(journal, ending)); !ok) return pass(ok);
  }
  if (auto ok = base::flush_folder(journal.parent_path()); !ok) return pass(ok);
  return any ? kept : fs::path();
}

}  // namespace

Result<RecoverReport> recover_journal(const fs::path& scan, const RecoverOptions& options) {
  std::error_code error;
  if (!fs::is_directory(scan, error))
    return fail(ErrorCode::not_found, "there is no such scan folder", scan.string());
  const auto job = machine::load_job_config((scan / "job.toml").string());
  if (!job) return pass(job);
  const fs::path journal = journal_path(scan);
  if (auto ok = refuse_if_open(journal); !ok) return pass(ok);
  if (!options.even_if_whole) {
    if (auto ok = refuse_if_whole(journal); !ok) return pass(ok);
  }
  const auto count = static_cast<std::int64_t>(job->poses.size());
  const auto salvage = salvage_journal(journal, count);
  if (!salvage) return pass(salvage);

  RecoverReport report;
  const fs::path made = beside(journal, ".part");
  for (const char* ending : {"", "-wal", "-shm"}) {
    if (auto ok = base::remove_tree(beside(made, ending)); !ok) return pass(ok);
  }
  {
    auto rebuilt = Journal::create(made, job->poses);
    if (!rebuilt) return pass(rebuilt);
    for (std::int64_t row = 0; row < count; ++row) {
      if (base::interrupted()) return base::interrupted_error("nothing was changed; recover again");
      auto recovered = recover_row(scan, row, *job, *salvage, *rebuilt);
      if (!recovered) return pass(recovered);
      report.rows.push_back(std::move(*recovered));
      if (options.on_row) options.on_row(static_cast<std::size_t>(count - row - 1));
    }
    auto visits = recover_visits(scan, *salvage, *rebuilt);
    if (!visits) return pass(visits);
    report.visits = std::move(*visits);
    if (auto ok = rebuilt->add_events(salvage->events); !ok) return pass(ok);
  }
  auto kept = set_aside(journal);
  if (!kept) return pass(kept);
  report.kept = std::move(*kept);
  if (auto ok = base::rename_durably(made, journal); !ok) return pass(ok);
  return report;
}

}  // namespace rig::scan
