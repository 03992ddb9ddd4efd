// How much a job writes.
#pragma once

#include "core/machine/job_config.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Most bytes that one pose takes on the disk: its frames and their part of the journal.
[[nodiscard]] double bytes_of_pose(const Setup& setup, const machine::JobConfig& job);

/// Bytes of a reference visit, likewise; 0 where rig.toml has no [reference].
[[nodiscard]] double bytes_of_visit(const Setup& setup);

/// Bytes that the scan's disk has to have for what is left of the running job, its visits included, without
/// the margin. How many visits the clock will ask for is foreseen from the pace of the poses so far.
[[nodiscard]] double bytes_left_to_write(const Setup& setup, const State& state);

}  // namespace rig::daemon
