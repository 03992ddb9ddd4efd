#include "daemon/storage.h"

#include <algorithm>
#include <future>
#include <utility>

#include "core/base/files.h"
#include "core/base/log.h"
#include "core/base/thread.h"
#include "core/scan/scan_directory.h"
#include "daemon/frame_piece.h"
#include "daemon/look.h"
#include "daemon/messages.h"
#include "daemon/place.h"
#include "daemon/report_files.h"
#include "protocol/report_text.h"

namespace rig::daemon {

using base::pass;
using base::Result;

Storage::Storage(base::Clock& clock, const machine::RigConfig& rig, std::string rig_toml, StateDb db,
                 FramePool& pool, Report report, PassOn pass_on, Tell tell)
    : clock_(clock),
      rig_(rig),
      rig_toml_(std::move(rig_toml)),
      db_(std::move(db)),
      pool_(pool),
      report_(std::move(report)),
      pass_on_(std::move(pass_on)),
      tell_(std::move(tell)),
      mailbox_(clock) {
  thread_ = std::thread([this, member = base::ClockMember(clock)] {
    base::name_thread("storage");
    // Nobody waits for the hashing and writing of a frame, but for an answer somebody does.
    base::give_way_to_others();
    run();
  });
}

Storage::~Storage() {
  mailbox_.push(std::nullopt);
  thread_.join();
}

void Storage::queue(Action action) {
  mailbox_.push(std::optional<Action>(std::move(action)));
}

void Storage::settle() {
  std::promise<void> settled;
  queue(AskStorage{[&settled] { settled.set_value(); }});
  settled.get_future().wait();
}

void Storage::run() {
  while (true) {
    const auto item = mailbox_.pop();
    if (!item) continue;
    if (!*item) return;
    carry_out(**item);
  }
}

void Storage::check(const Result<void>& result) {
  if (!result) tell_failure(result.error());
}

void Storage::tell_failure(const base::Error& error) {
  report_(StorageFailed{error.text(), 0, error.code == base::ErrorCode::io});
}

void Storage::carry_out(const Action& action) {
  if (const auto* create = std::get_if<CreateJob>(&action)) return create_job(*create);
  if (const auto* open = std::get_if<OpenJob>(&action)) return open_job(*open);
  if (const auto* save = std::get_if<SaveJob>(&action)) return check(db_.save_job(save->entry));
  if (const auto* order = std::get_if<SaveOrder>(&action)) return check(db_.save_order(order->jobs));
  if (const auto* poll = std::get_if<PollDisk>(&action)) return poll_disk(*poll);
  if (const auto* event = std::get_if<KeepEvent>(&action)) return keep_event(*event);
  if (const auto* space = std::get_if<CheckSpace>(&action)) return check_space(*space);
  if (const auto* asked = std::get_if<SendFramePiece>(&action)) return send_frame_piece(*asked);
  if (const auto* asked = std::get_if<SendReport>(&action)) return send_report(*asked);
  if (const auto* job = std::get_if<TellOfJob>(&action)) return tell_of_job(*job);
  if (const auto* told = std::get_if<ReportTold>(&action)) return forget_report(told->job);
  if (const auto* stop = std::get_if<SaveStop>(&action)) return check(db_.save_stopped(stop->reason));
  if (const auto* lease = std::get_if<SaveLease>(&action)) return check(db_.save_lease_holder(lease->holder));
  if (const auto* store = std::get_if<StoreFrame>(&action)) return store_frame(*store);
  if (const auto* commit = std::get_if<CommitPose>(&action)) return commit_pose(*commit);
  if (const auto* discard = std::get_if<DiscardBracket>(&action)) {
    return check(scan::discard_bracket(scan_, discard->row));
  }
  if (const auto* failure = std::get_if<RecordFailure>(&action)) {
    if (journal_)
      check(journal_->record_failure(failure->row, failure->reason, failure->abandon, failure->events));
    return;
  }
  if (const auto* look = std::get_if<JudgeLook>(&action)) return judge_look(*look);
  if (const auto* visit = std::get_if<RecordVisit>(&action)) return record_visit(*visit);
  if (std::holds_alternative<SendReply>(action)) return pass_on_(action);
  if (const auto* ask = std::get_if<AskStorage>(&action)) return ask->answer();
  base::log_error("an action came to the storage that does not belong there");
}

namespace {

constexpr std::size_t kMostWaitingEvents = 10000;

// Where the folder will be: the nearest one above it that exists.
std::filesystem::path existing_above(std::filesystem::path folder) {
  std::error_code error;
  while (folder.has_relative_path() && !std::filesystem::exists(folder, error)) folder = folder.parent_path();
  return folder;
}

Result<double> free_bytes_at(const std::filesystem::path& folder) {
  std::error_code error;
  const auto space = std::filesystem::space(existing_above(folder), error);
  if (error) return base::fail(base::ErrorCode::io, error.message(), folder.string());
  return static_cast<double>(space.available);
}

Result<void> room_for(const std::filesystem::path& folder, double bytes_needed) {
  const auto free = free_bytes_at(folder);
  if (!free) return base::pass(free);
  if (*free >= bytes_needed) return {};
  return base::fail(base::ErrorCode::refused,
                    fmt::format("has {:.1f} MB free; the job and [suspend] disk_margin_mb need {:.1f} MB",
                                *free * 1e-6, bytes_needed * 1e-6),
                    folder.string(), "scan to another disk, or make room");
}

}  // namespace

// An event that cannot be kept waits until it can: without it a late joiner misses something and the report
// a reason, but the scan nothing.
void Storage::keep_event(const KeepEvent& action) {
  events_.push_back(action);
  keep_what_waits();
}

void Storage::keep_what_waits() {
  while (!events_.empty()) {
    const KeepEvent& next = events_.front();
    std::error_code error;
    const bool in_journal = next.job != 0 && next.job == job_ && journal_ &&
                            std::filesystem::exists(scan::journal_path(scan_), error);
    const auto kept = in_journal ? journal_->add_events({next.event}) : db_.add_event(next.event);
    if (!kept) {
      if (events_.size() == 1) base::log_error("events are not kept for now: {}", kept.error().text());
      if (events_.size() > kMostWaitingEvents) events_.pop_front();
      return;
    }
    events_.pop_front();
  }
}

void Storage::check_space(const CheckSpace& action) {
  protocol::Preflight flight = action.preflight;
  if (!action.scan_folder.empty()) {
    const std::filesystem::path folder = action.scan_folder;
    std::error_code error;
    if (std::filesystem::exists(folder, error) && !std::filesystem::is_empty(folder, error)) {
      flight.add_problems(folder.string() + ": exists and is not empty");
    }
    if (auto ok = scan::refuse_network_disk(existing_above(folder)); !ok) {
      flight.add_problems(ok.error().text());
    }
    if (const auto free = free_bytes_at(folder); free)
      flight.set_bytes_free(static_cast<std::uint64_t>(*free));
    const double need = static_cast<double>(flight.bytes_needed()) + action.margin_bytes;
    if (auto ok = room_for(folder, need); !ok) flight.add_problems(ok.error().text());
  }
  flight.set_ok(flight.problems().empty());
  auto reply = make_reply(action.asker.id, protocol::DONE);
  *reply.mutable_preflight() = std::move(flight);
  pass_on_(daemon::SendReply{action.asker.client, std::move(reply)});
}

Result<protocol::Report> Storage::report_of(const protocol::JobInfo& job) {
  constexpr std::size_t kMostEvents = 1000000;
  auto kept = db_.last_events(kMostEvents);
  if (!kept) return base::pass(kept);
  return read_report(job, *kept);
}

void Storage::send_frame_piece(const SendFramePiece& action) {
  const auto read = [&]() -> Result<protocol::FramePiece> {
    // The open journal knows it without another look through the whole database.
    if (journal_ && scan_ == action.scan_folder) return read_frame_piece(scan_, *journal_, action.wanted);
    const auto journal = scan::Journal::open_read_only(scan::journal_path(action.scan_folder));
    if (!journal) return pass(journal);
    return read_frame_piece(action.scan_folder, *journal, action.wanted);
  };
  auto piece = read();
  auto reply = make_reply(action.asker.id, piece ? protocol::DONE : protocol::FAILED,
                          piece ? std::string() : piece.error().text());
  if (piece) *reply.mutable_frame_piece() = std::move(*piece);
  pass_on_(daemon::SendReply{action.asker.client, std::move(reply)});
}

void Storage::send_report(const SendReport& action) {
  auto report = report_of(action.job);
  auto reply = make_reply(action.asker.id, report ? protocol::DONE : protocol::FAILED,
                          report ? std::string() : report.error().text());
  if (report) *reply.mutable_report() = std::move(*report);
  pass_on_(daemon::SendReply{action.asker.client, std::move(reply)});
}

// Until both are done, the next rigd writes and tells it again.
void Storage::forget_report(std::uint64_t job) {
  const bool unwritten = std::any_of(reports_.begin(), reports_.end(), [job](const protocol::Report& report) {
    return report.job().job() == job;
  });
  if (unwritten) {
    told_.push_back(job);
  } else {
    check(db_.forget_report_due(job));
  }
}

void Storage::tell_of_job(const TellOfJob& action) {
  std::function<void()> told;
  if (action.ended) {
    check(db_.note_report_due(action.job.job()));
    told = [this, job = action.job.job()] { queue(ReportTold{job}); };
  }
  auto report = report_of(action.job);
  if (!report) {
    // Somebody has to learn of it even where the scan is gone.
    base::log_error("no report of job {}: {}", action.job.job(), report.error().text());
    protocol::Report bare;
    *bare.mutable_job() = action.job;
    tell_(action.occasion, protocol::report_text(bare), std::move(told));
    return;
  }
  if (action.ended) write_report_of(*report);
  tell_(action.occasion, protocol::report_text(*report), std::move(told));
}

// What the disk does not take now is written when it takes files again.
void Storage::write_report_of(const protocol::Report& report) {
  const auto written = write_report(report);
  if (written) return;
  base::log_error("report: {}", written.error().text());
  if (written.error().code != base::ErrorCode::io) return;
  reports_.push_back(report);
  tell_failure(written.error());
}

void Storage::create_job(const CreateJob& action) {
  const auto made = [&]() -> Result<JobEntry> {
    const auto config = machine::parse_job_config(action.submit.job_toml(), action.submit.job_name());
    if (!config) return base::pass(config);
    if (auto ok = room_for(action.submit.scan_folder(), action.bytes_needed); !ok) return base::pass(ok);
    const auto id = db_.next_job_id();
    if (!id) return base::pass(id);
    if (auto ok = scan::create_scan(action.submit.scan_folder(), rig_toml_, action.submit.job_toml()); !ok) {
      return base::pass(ok);
    }
    JobEntry entry;
    entry.id = *id;
    entry.name = config->name;
    entry.sample = config->sample;
    entry.needs_sample_change = config->needs_sample_change;
    entry.scan_folder = action.submit.scan_folder();
    entry.poses = static_cast<std::int64_t>(config->poses.size());
    if (auto ok = db_.save_job(entry); !ok) return base::pass(ok);
    return entry;
  };
  report_(JobCreated{action.asker, made()});
}

void Storage::open_job(const OpenJob& action) {
  scan_ = action.scan_folder;
  job_ = action.id;
  journal_.reset();
  if (!scan_is_there()) return;
  const auto opened = [&]() -> Result<JobOpened> {
    auto config = machine::load_job_config((scan_ / "job.toml").string());
    if (!config) return base::pass(config);
    auto journal = scan::Journal::open(scan::journal_path(scan_));
    if (!journal) return base::pass(journal);
    if (auto ok = scan::tidy_scan(scan_, *journal); !ok) return base::pass(ok);
    auto pending = journal->pending(0, config->poses.size());
    if (!pending) return base::pass(pending);
    auto progress = journal->progress();
    if (!progress) return base::pass(progress);
    auto visits = journal->visits_so_far();
    if (!visits) return pass(visits);
    const auto latest = journal->latest();
    if (!latest) return pass(latest);
    latest_ = *latest;
    JobOpened opened_job{action.id,
                         std::make_shared<const machine::JobConfig>(std::move(*config)),
                         std::move(*pending),
                         *progress,
                         std::move(*visits),
                         {},
                         {}};
    if (auto place = find_place(scan_, *journal, rig_); place) {
      opened_job.place = std::move(*place);
    } else {
      opened_job.not_checked = place.error().text();
    }
    journal_ = std::move(*journal);
    return opened_job;
  };
  auto result = opened();
  if (result) {
    report_(std::move(*result));
  } else {
    tell_failure(result.error());
  }
}

// The machine's clock may have been set back since rigd was last started; a pose must not come before the
// visit that was made before it.
base::Time Storage::in_order(base::Time time) {
  return latest_ = std::max(time, latest_ + base::Duration(1));
}

// A folder that was moved or removed would be made anew by the next frame, without its journal.
bool Storage::scan_is_there() {
  std::error_code error;
  if (std::filesystem::exists(scan::journal_path(scan_), error)) return true;
  report_(StorageFailed{
      fmt::format("{}: the scan's folder or its journal is no longer there", scan_.string()), job_});
  return false;
}

void Storage::poll_disk(const PollDisk& action) {
  DiskRead read;
  if (action.write) {
    if (job_ != 0 && !scan_is_there()) return;
    const auto written = try_to_write();
    if (!written) base::log_warning("the disk: {}", written.error().text());
    read.takes_files = written.has_value();
    if (written) {
      keep_what_waits();
      for (const protocol::Report& report : std::exchange(reports_, {})) write_report_of(report);
      for (const std::uint64_t job : std::exchange(told_, {})) forget_report(job);
    }
  }
  std::error_code error;
  const auto space = std::filesystem::space(scan_, error);
  // A folder that is not there is told by what wants to write.
  if (error && !action.write) return;
  if (!error) read.free_bytes = static_cast<double>(space.available);
  report_(read);
}

// Whether a frame finds room in the scan, and a little beside rigd's own state.
Result<void> Storage::try_to_write() const {
  const auto write_once = [](const std::filesystem::path& path, std::size_t bytes) -> Result<void> {
    const std::vector<std::byte> content(bytes);
    const auto written = base::write_and_flush(path, content);
    if (auto removed = base::remove_tree(path); !removed && written) return removed;
    return written;
  };
  constexpr std::size_t kOwnState_bytes = 1 << 20;
  if (auto ok = write_once(db_.folder() / "probe.part", kOwnState_bytes); !ok) return ok;
  if (job_ == 0) return {};
  const auto& size = rig_.camera.intrinsics;
  const auto samples = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  // Where tidy_scan() would find it, if rigd died now.
  return write_once(scan_ / "frames" / "probe.part", samples * sizeof(std::uint16_t));
}

void Storage::store_frame(const StoreFrame& action) {
  const Timings::Measure measure(timings_);
  scan::FrameFacts facts;
  facts.row = action.pose.row;
  facts.index = action.frame.index;
  facts.target_rad = action.pose.target_rad;
  facts.readback_rad = action.pose.readback_rad;
  facts.exposure_s = action.frame.exposure_s;
  facts.gain = action.frame.gain;
  facts.bayer = geometry::text_from_bayer(rig_.camera.bayer);
  facts.bits = rig_.camera.sensor.bits;
  if (!scan_is_there()) {
    pool_.release(action.slot);
    return;
  }
  const auto hash = scan::store_frame(scan_, facts, rig_.camera.intrinsics.width,
                                      rig_.camera.intrinsics.height, pool_.pixels(action.slot).data());
  pool_.release(action.slot);
  if (hash) {
    report_(FrameStored{facts.row, facts.index, *hash, action.pose.number});
  } else {
    tell_failure(hash.error());
  }
}

void Storage::judge_look(const JudgeLook& action) {
  if (action.kind == Visit::Kind::reference && !scan_is_there()) {
    pool_.release(action.slot);
    return;
  }
  auto finding = judge(rig_, scan_, action, pool_.pixels(action.slot));
  pool_.release(action.slot);
  // The light is not to blame for it.
  if (!finding && finding.error().code == base::ErrorCode::io) return tell_failure(finding.error());
  report_(LookJudged{action.exposure, std::move(finding)});
}

void Storage::record_visit(const RecordVisit& action) {
  if (!scan_is_there()) return;
  const auto recorded = [&]() -> Result<VisitRecorded> {
    if (!journal_) return base::fail(base::ErrorCode::io, "no journal is open", scan_.string());
    VisitRecorded out{action.visit, {}, {}, {}};
    out.visit.when = in_order(out.visit.when);
    if (!out.visit.looks.empty()) {
      if (auto ok = scan::publish_visit(scan_, out.visit.number); !ok) return pass(ok);
    }
    auto again = journal_->record_visit(out.visit, action.retake, {});
    if (!again) return pass(again);
    out.again = std::move(*again);
    for (const std::int64_t row : out.again) {
      if (auto ok = base::remove_tree(scan::frames_folder(scan_, row)); !ok) return pass(ok);
    }
    if (!out.again.empty()) {
      auto pending = journal_->pending(0, static_cast<std::size_t>(-1) / 2);
      if (!pending) return pass(pending);
      out.pending = std::move(*pending);
    }
    const auto progress = journal_->progress();
    if (!progress) return pass(progress);
    out.progress = *progress;
    return out;
  };
  auto result = recorded();
  if (result) {
    report_(std::move(*result));
  } else {
    tell_failure(result.error());
  }
}

void Storage::commit_pose(const CommitPose& action) {
  if (!scan_is_there()) return;
  const auto done = [&]() -> Result<void> {
    if (!journal_) return base::fail(base::ErrorCode::io, "no journal is open", scan_.string());
    if (auto ok = scan::publish_bracket(scan_, action.pose.row); !ok) return ok;
    scan::PoseRecord record;
    record.row = action.pose.row;
    record.attempt = action.pose.attempt;
    record.target_rad = action.pose.target_rad;
    record.readback_rad = action.pose.readback_rad;
    record.arrived = action.pose.arrived;
    record.committed = in_order(clock_.now());
    record.frames = action.pose.frames;
    record.short_share = action.pose.short_share;
    for (scan::FrameRecord& frame : record.frames) {
      frame.file = std::filesystem::relative(scan::frames_folder(scan_, record.row), scan_).string() + "/" +
                   scan::frame_name(frame.index);
    }
    return journal_->commit_pose(record, action.events);
  };
  if (auto ok = done(); !ok) {
    tell_failure(ok.error());
    return;
  }
  report_(PoseCommitted{action.pose.row});
  check(scan::discard_bracket(scan_, action.pose.row));  // an older take, if there was one
}

}  // namespace rig::daemon
