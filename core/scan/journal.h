// journal.sqlite: the plan of a scan and what became of it. SQLite in WAL mode with full synchronisation; a
// pose is in it with all its frames, or pending.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "core/machine/pose.h"
#include "core/scan/visits.h"

namespace rig::scan {

enum class RowState { pending, done, abandoned };

/// One line of the plan.
struct PlanRow {
  std::int64_t row = 0;
  machine::JointAngles target_rad{};
  RowState state = RowState::pending;
  int attempts = 0;    ///< that were begun and failed
  std::string reason;  ///< of the last failure or of the abandonment
};

struct FrameRecord {
  int index = 0;
  std::string file;  ///< relative to the scan directory: "frames/000012/00.tif"
  double exposure_s = 0;
  double gain = 1;
  double saturated_share = 0;  ///< of the pixels inside the sample's outline
  base::Time started{};
  std::string sha256;
};

/// Proof of arrival and the frames of one committed pose.
struct PoseRecord {
  std::int64_t row = 0;
  int attempt = 1;
  machine::JointAngles target_rad{};
  machine::JointAngles readback_rad{};
  base::Time arrived{};
  base::Time committed{};
  std::vector<FrameRecord> frames;
  /// Adaptive exposure: share of the sample's pixels that miss the signal-to-noise ratio asked for.
  std::optional<double> short_share{};
};

struct EventRecord {
  std::uint64_t epoch = 0;
  std::uint64_t number = 0;
  base::Time time{};
  std::string payload;  ///< serialised protocol event
};

struct ScanProgress {
  std::int64_t total = 0, done = 0, abandoned = 0;
};

class Journal {
 public:
  /// Makes the journal of a new scan; fails where one exists.
  [[nodiscard]] static base::Result<Journal> create(const std::filesystem::path& path,
                                                    const std::vector<machine::JointAngles>& plan);
  /// Opens for writing after an integrity check; damage is an error that says how to recover.
  [[nodiscard]] static base::Result<Journal> open(const std::filesystem::path& path);
  [[nodiscard]] static base::Result<Journal> open_read_only(const std::filesystem::path& path);
  /// For what can still be read of a damaged one: each call tells for itself whether it could. Writes to the
  /// file (its log is folded in), so it wants a copy.
  [[nodiscard]] static base::Result<Journal> open_damaged(const std::filesystem::path& path);

  Journal(Journal&&) noexcept;
  Journal& operator=(Journal&&) noexcept;
  ~Journal();

  [[nodiscard]] base::Result<ScanProgress> progress() const;
  [[nodiscard]] base::Result<std::vector<PlanRow>> plan() const;
  /// One line of the plan, if it has it.
  [[nodiscard]] base::Result<std::optional<PlanRow>> plan_row(std::int64_t row) const;
  /// The pending rows in order, at most `limit`, from row `from` on.
  [[nodiscard]] base::Result<std::vector<PlanRow>> pending(std::int64_t from, std::size_t limit) const;

  /// Every record of done poses, in row order.
  [[nodiscard]] base::Result<std::vector<PoseRecord>> poses() const;
  [[nodiscard]] base::Result<std::optional<PoseRecord>> pose(std::int64_t row) const;

  /// Writes the journal as it is now into one new file without a log.
  [[nodiscard]] base::Result<void> copy_to(const std::filesystem::path& path) const;

  /// Each of these is one durable transaction, with the events that belong to it.
  [[nodiscard]] base::Result<void> commit_pose(const PoseRecord& pose,
                                               const std::vector<EventRecord>& events);
  [[nodiscard]] base::Result<void> record_failure(std::int64_t row, const std::string& reason, bool abandon,
                                                  const std::vector<EventRecord>& events);
  /// The rows of the poses that are pending again are returned, and the caller removes their frames.
  [[nodiscard]] base::Result<std::vector<std::int64_t>> record_visit(const VisitRecord& visit, Retake retake,
                                                                     const std::vector<EventRecord>& events);
  [[nodiscard]] base::Result<std::vector<VisitRecord>> visits() const;
  /// The latest time that a commit or a visit has. What is proven by which visit is told by these times: a
  /// writer gives no earlier ones, whatever its clock says.
  [[nodiscard]] base::Result<base::Time> latest() const;
  [[nodiscard]] base::Result<VisitsSoFar> visits_so_far() const;
  [[nodiscard]] base::Result<void> add_events(const std::vector<EventRecord>& events);
  [[nodiscard]] base::Result<std::vector<EventRecord>> events_after(std::uint64_t epoch, std::uint64_t number,
                                                                    std::size_t limit) const;

 private:
  struct State;
  explicit Journal(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace rig::scan
