// The morning report from a scan's folder, and into it.
#pragma once

#include <vector>

#include "core/base/result.h"
#include "core/scan/journal.h"
#include "protocol/rig.pb.h"

namespace rig::daemon {

/// Reads the scan of `job`; `kept` are events that rigd kept outside of the journal.
[[nodiscard]] base::Result<protocol::Report> read_report(const protocol::JobInfo& job,
                                                         const std::vector<scan::EventRecord>& kept);

/// Writes report.json and report.txt into the scan's folder.
[[nodiscard]] base::Result<void> write_report(const protocol::Report& report);

}  // namespace rig::daemon
