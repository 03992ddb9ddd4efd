// The morning report: what became of a job, pose by pose, and why.
#pragma once

#include <vector>

#include "core/scan/journal.h"
#include "protocol/rig.pb.h"

namespace rig::daemon {

/// From the plan, the poses and the events of a scan's journal, and events kept elsewhere; those of other
/// jobs are left out.
[[nodiscard]] protocol::Report make_report(const protocol::JobInfo& job,
                                           const std::vector<scan::PlanRow>& plan,
                                           const std::vector<scan::PoseRecord>& poses,
                                           const std::vector<scan::EventRecord>& events,
                                           const std::vector<scan::VisitRecord>& visits = {});

}  // namespace rig::daemon
