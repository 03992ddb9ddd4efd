// What happens to the rig, in the log.
#pragma once

#include "protocol/rig.pb.h"

namespace rig::daemon {

/// Stops, alarms, failed poses and changes of jobs, with fields for the journal: RIG_EVENT, RIG_JOB, RIG_ROW,
/// RIG_ATTEMPT, RIG_REASON. Other events leave no line.
void log_event(const protocol::Event& event);

}  // namespace rig::daemon
