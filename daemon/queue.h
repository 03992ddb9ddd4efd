// The queue of jobs as operators handle it: holding, releasing, reordering; and parking after an abort.
#pragma once

#include "core/base/result.h"
#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// Holds a queued or active job. An Error says why not.
[[nodiscard]] base::Result<void> hold_job(State& state, Actions& actions, std::uint64_t id,
                                          const std::string& reason);
/// Ends a hold, or an active job's wait for a changed sample.
[[nodiscard]] base::Result<void> release_job(State& state, Actions& actions, std::uint64_t id);
/// Puts a queued job before another, or (0) behind all.
[[nodiscard]] base::Result<void> reorder_job(State& state, Actions& actions, std::uint64_t id,
                                             std::uint64_t before);

/// Moves the axes of an aborted job to the rig's park pose, once they are known to stand.
void advance_parking(const Setup& setup, State& state, Actions& actions);

}  // namespace rig::daemon
