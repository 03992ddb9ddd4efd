// The thread that owns the disk: frames, journals, rigd's own state. Its errors become events.
#pragma once

#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/clock.h"
#include "core/scan/journal.h"
#include "daemon/action.h"
#include "daemon/frame_pool.h"
#include "daemon/state_db.h"
#include "daemon/timings.h"

namespace rig::daemon {

class Storage {
 public:
  using Report = std::function<void(What)>;
  using PassOn = std::function<void(const Action&)>;
  /// `told` is to be called, on any thread, when somebody has had it.
  using Tell = std::function<void(std::string occasion, std::string report, std::function<void()> told)>;

  /// `rig_toml` is the text of the file rigd runs on, copied into every scan.
  Storage(base::Clock& clock, const machine::RigConfig& rig, std::string rig_toml, StateDb db,
          FramePool& pool, Report report, PassOn pass_on, Tell tell);
  /// Carries out what is queued, then ends.
  ~Storage();
  Storage(const Storage&) = delete;
  Storage& operator=(const Storage&) = delete;

  /// How many actions wait, and how long the storing of a frame took.
  [[nodiscard]] std::size_t waiting() const { return mailbox_.size(); }
  [[nodiscard]] Timings& timings() { return timings_; }

  /// One of CreateJob, OpenJob, SaveJob, SaveOrder, PollDisk, KeepEvent, CheckSpace, SendReport, TellOfJob,
  /// ReportTold, StoreFrame, CommitPose, DiscardBracket, RecordFailure, JudgeLook, RecordVisit, SaveStop,
  /// SaveLease, AskStorage, or an answer to be passed on once all that was queued before it is on the disk.
  void queue(Action action);

  /// Returns when everything that was queued is carried out.
  void settle();

 private:
  void run();
  void carry_out(const Action& action);
  void create_job(const CreateJob& action);
  void open_job(const OpenJob& action);
  void store_frame(const StoreFrame& action);
  void commit_pose(const CommitPose& action);
  void judge_look(const JudgeLook& action);
  void record_visit(const RecordVisit& action);
  void poll_disk(const PollDisk& action);
  [[nodiscard]] base::Result<void> try_to_write() const;
  void keep_event(const KeepEvent& action);
  void keep_what_waits();
  void write_report_of(const protocol::Report& report);
  void forget_report(std::uint64_t job);
  void check_space(const CheckSpace& action);
  void send_frame_piece(const SendFramePiece& action);
  void send_report(const SendReport& action);
  void tell_of_job(const TellOfJob& action);
  [[nodiscard]] base::Result<protocol::Report> report_of(const protocol::JobInfo& job);
  [[nodiscard]] bool scan_is_there();
  void check(const base::Result<void>& result);
  void tell_failure(const base::Error& error);
  [[nodiscard]] base::Time in_order(base::Time time);

  base::Clock& clock_;
  const machine::RigConfig rig_;
  const std::string rig_toml_;
  StateDb db_;
  FramePool& pool_;
  Report report_;
  PassOn pass_on_;
  Tell tell_;
  std::filesystem::path scan_;
  std::uint64_t job_ = 0;  ///< whose scan is open
  std::optional<scan::Journal> journal_;
  base::Time latest_{};                    ///< that the open journal has
  std::deque<KeepEvent> events_;           ///< not yet kept, in their order
  std::vector<protocol::Report> reports_;  ///< of ended jobs, not yet written
  std::vector<std::uint64_t> told_;        ///< of those, already told
  Timings timings_;
  base::Mailbox<std::optional<Action>> mailbox_;
  std::thread thread_;
};

}  // namespace rig::daemon
