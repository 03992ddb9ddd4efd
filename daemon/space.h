// How much a job writes.
#pragma once

#include "core/machine/job_config.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Most frames that one pose may take.
[[nodiscard]] int most_frames(const machine::ExposureConfig& exposure);

/// Seconds of the longest bracket of one pose: exposures, and the readouts between them.
[[nodiscard]] double bracket_s(const Setup& setup, const machine::ExposureConfig& exposure);

/// Most bytes that one pose takes on the disk: its frames and their part of the journal.
[[nodiscard]] double bytes_of_pose(const Setup& setup, const machine::JobConfig& job);

}  // namespace rig::daemon
