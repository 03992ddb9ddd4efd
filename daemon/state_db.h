// What rigd itself remembers, /var/lib/rigd/state.sqlite: the queue, the latched stop, who holds control, the
// epoch. Written before the answer.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/folder_lock.h"
#include "core/base/result.h"
#include "core/scan/sqlite.h"
#include "daemon/state.h"

namespace rig::daemon {

/// For the process that has the rig: rigd, or rigd-safe while it is at work. Busy where another has it.
[[nodiscard]] base::Result<base::FolderLock> take_state_folder(const std::filesystem::path& folder);

class StateDb {
 public:
  [[nodiscard]] static base::Result<StateDb> open(const std::filesystem::path& folder);
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

  /// The number of this start of rigd: one more than the last.
  [[nodiscard]] base::Result<std::uint64_t> begin_epoch();
  [[nodiscard]] base::Result<std::vector<JobEntry>> jobs() const;  ///< as they stand in the queue
  [[nodiscard]] base::Result<std::uint64_t> next_job_id() const;
  /// Of a job that ends here as aborted or failed it is noted, in the same transaction, that its report is
  /// due.
  [[nodiscard]] base::Result<void> save_job(const JobEntry& job);
  /// Ended jobs whose report is not yet in the scan folder and told.
  [[nodiscard]] base::Result<std::vector<std::uint64_t>> reports_due() const;
  [[nodiscard]] base::Result<void> note_report_due(std::uint64_t job);
  [[nodiscard]] base::Result<void> forget_report_due(std::uint64_t job);
  /// The queue's order: every job's number.
  [[nodiscard]] base::Result<void> save_order(const std::vector<std::uint64_t>& jobs);
  /// Events that belong to no pose. They outlive the process at once, a power cut only in a while: none of
  /// them is needed to go on.
  [[nodiscard]] base::Result<void> add_event(const scan::EventRecord& event);
  /// The last ones, as they were told; older ones than that are removed.
  [[nodiscard]] base::Result<std::vector<scan::EventRecord>> last_events(std::size_t most);
  [[nodiscard]] base::Result<std::string> stopped() const;
  [[nodiscard]] base::Result<void> save_stopped(const std::string& reason);
  /// Who holds control; empty: nobody.
  [[nodiscard]] base::Result<std::string> lease_holder() const;
  [[nodiscard]] base::Result<void> save_lease_holder(const std::string& holder);

 private:
  StateDb(std::filesystem::path folder, scan::Database database)
      : folder_(std::move(folder)), database_(std::move(database)) {}
  [[nodiscard]] base::Result<std::string> fact(const char* key) const;
  [[nodiscard]] base::Result<void> save_fact(const char* key, const std::string& value);

  std::filesystem::path folder_;
  scan::Database database_;
};

}  // namespace rig::daemon
