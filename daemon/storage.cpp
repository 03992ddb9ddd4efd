#include "daemon/storage.h"

#include "core/base/log.h"
#include "core/scan/scan_directory.h"

namespace rig::daemon {

using base::Result;

Storage::Storage(base::Clock& clock, const machine::CameraConfig& camera, std::string rig_toml, StateDb db,
                 FramePool& pool, Report report, PassOn pass_on)
    : clock_(clock),
      camera_(camera),
      rig_toml_(std::move(rig_toml)),
      db_(std::move(db)),
      pool_(pool),
      report_(std::move(report)),
      pass_on_(std::move(pass_on)),
      mailbox_(clock) {
  thread_ = std::thread([this, member = base::ClockMember(clock)] { run(); });
}

Storage::~Storage() {
  mailbox_.push(std::nullopt);
  thread_.join();
}

void Storage::queue(Action action) {
  mailbox_.push(std::optional<Action>(std::move(action)));
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
  if (!result) report_(StorageFailed{result.error().text()});
}

void Storage::carry_out(const Action& action) {
  if (const auto* create = std::get_if<CreateJob>(&action)) return create_job(*create);
  if (const auto* open = std::get_if<OpenJob>(&action)) return open_job(*open);
  if (const auto* save = std::get_if<SaveJob>(&action)) return check(db_.save_job(save->entry));
  if (const auto* stop = std::get_if<SaveStop>(&action)) return check(db_.save_stopped(stop->reason));
  if (const auto* store = std::get_if<StoreFrame>(&action)) return store_frame(*store);
  if (const auto* commit = std::get_if<CommitPose>(&action)) return commit_pose(*commit);
  if (const auto* discard = std::get_if<DiscardBracket>(&action)) {
    return check(scan::discard_bracket(scan_, discard->row));
  }
  if (const auto* failure = std::get_if<RecordFailure>(&action)) {
    if (journal_) check(journal_->record_failure(failure->row, failure->reason, failure->abandon, {}));
    return;
  }
  if (std::holds_alternative<SendReply>(action)) return pass_on_(action);
  base::log_error("an action came to the storage that does not belong there");
}

void Storage::create_job(const CreateJob& action) {
  const auto made = [&]() -> Result<JobEntry> {
    const auto config = machine::parse_job_config(action.submit.job_toml(), action.submit.job_name());
    if (!config) return base::pass(config);
    const auto id = db_.next_job_id();
    if (!id) return base::pass(id);
    if (auto ok = scan::create_scan(action.submit.scan_folder(), rig_toml_, action.submit.job_toml()); !ok) {
      return base::pass(ok);
    }
    JobEntry entry;
    entry.id = *id;
    entry.name = config->name;
    entry.sample = config->sample;
    entry.scan_folder = action.submit.scan_folder();
    entry.poses = static_cast<std::int64_t>(config->poses.size());
    if (auto ok = db_.save_job(entry); !ok) return base::pass(ok);
    return entry;
  };
  report_(JobCreated{action.asker, made()});
}

void Storage::open_job(const OpenJob& action) {
  scan_ = action.scan_folder;
  journal_.reset();
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
    journal_ = std::move(*journal);
    return JobOpened{action.id, std::make_shared<const machine::JobConfig>(std::move(*config)),
                     std::move(*pending), *progress};
  };
  auto result = opened();
  if (result) {
    report_(std::move(*result));
  } else {
    report_(StorageFailed{result.error().text()});
  }
}

void Storage::store_frame(const StoreFrame& action) {
  scan::FrameFacts facts;
  facts.row = action.pose.row;
  facts.index = action.frame.index;
  facts.target_rad = action.pose.target_rad;
  facts.readback_rad = action.pose.readback_rad;
  facts.exposure_s = action.frame.exposure_s;
  facts.gain = action.frame.gain;
  facts.bayer = geometry::text_from_bayer(camera_.bayer);
  facts.bits = camera_.sensor.bits;
  const auto hash = scan::store_frame(scan_, facts, camera_.intrinsics.width, camera_.intrinsics.height,
                                      pool_.pixels(action.slot).data());
  pool_.release(action.slot);
  if (hash) {
    report_(FrameStored{facts.row, facts.index, *hash});
  } else {
    report_(StorageFailed{hash.error().text()});
  }
}

void Storage::commit_pose(const CommitPose& action) {
  const auto done = [&]() -> Result<void> {
    if (!journal_) return base::fail(base::ErrorCode::io, "no journal is open", scan_.string());
    if (auto ok = scan::publish_bracket(scan_, action.pose.row); !ok) return ok;
    scan::PoseRecord record;
    record.row = action.pose.row;
    record.attempt = action.pose.attempt;
    record.target_rad = action.pose.target_rad;
    record.readback_rad = action.pose.readback_rad;
    record.arrived = action.pose.arrived;
    record.committed = clock_.now();
    record.frames = action.pose.frames;
    for (scan::FrameRecord& frame : record.frames) {
      frame.file = std::filesystem::relative(scan::frames_folder(scan_, record.row), scan_).string() + "/" +
                   scan::frame_name(frame.index);
    }
    return journal_->commit_pose(record, action.events);
  };
  if (auto ok = done(); !ok) {
    report_(StorageFailed{ok.error().text()});
    return;
  }
  report_(PoseCommitted{action.pose.row});
  check(scan::discard_bracket(scan_, action.pose.row));  // an older take, if there was one
}

}  // namespace rig::daemon
