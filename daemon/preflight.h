// A whole job looked at before the first move.
#pragma once

#include "core/machine/job_config.h"
#include "daemon/state.h"
#include "protocol/rig.pb.h"

namespace rig::daemon {

/// Limits, keep-out rules, exposures and lamp life as problems; and how long the job takes, at most, and what
/// it writes. What the disk says is added by the storage.
[[nodiscard]] protocol::Preflight preflight(const Setup& setup, const State& state,
                                            const machine::JobConfig& job);

}  // namespace rig::daemon
