// A journal rebuilt from the frames of a scan, where it was lost or is damaged.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scan/journal.h"

namespace rig::scan {

/// What the rebuilt journal says of one row, and why.
struct RecoveredRow {
  std::int64_t row = 0;
  RowState state = RowState::pending;
  int frames = 0;       ///< of a pose that is done
  bool proven = false;  ///< every frame has the hash that the old journal recorded
  std::string reason;   ///< where not done: what is missing or wrong
};

/// What the rebuilt journal says of one reference visit.
struct RecoveredVisit {
  std::int64_t number = 0;
  int frames = 0;
  bool judged = false;  ///< its verdict is that of the old journal
  std::string reason;   ///< where it is not in the new journal: what is wrong
};

struct RecoverReport {
  std::vector<RecoveredRow> rows;
  std::vector<RecoveredVisit> visits;
  std::filesystem::path kept;  ///< where the old journal is now; empty: there was none
};

struct RecoverOptions {
  bool even_if_whole = false;  ///< rebuild also a journal that can be read: one from an old copy of the scan
  std::function<void(std::size_t)> on_row;  ///< after each row, with the number still to do; may be empty
};

/// Rebuilds `scan`/journal.sqlite from job.toml and the frames. A row is done where its folder holds a whole
/// bracket of readable frames that say they are of this row and its target; hashes are taken anew, and
/// compared with what can still be read of the old journal, which also gives the times, the abandoned rows
/// and the events. A reference visit whose frames are there is kept; one whose verdict cannot be read is
/// neither good nor bad from then on, and the job's next one begins anew. The old journal is kept beside it
/// as journal.sqlite.old-N. No frame is touched. Refused while a program has the journal open.
[[nodiscard]] base::Result<RecoverReport> recover_journal(const std::filesystem::path& scan,
                                                          const RecoverOptions& options);

}  // namespace rig::scan
