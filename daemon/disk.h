// What the disk says of itself: how much is free, and that it takes no more. A full or read-only disk
// suspends the job, which goes on by itself once files can be written again.
#pragma once

#include "daemon/action.h"
#include "daemon/state.h"

namespace rig::daemon {

/// A disk that refuses leaves the active job suspended (the condition `disk`), its pose to be taken again;
/// every few seconds it is tried to write. What no room can mend, and what fails again and again without a
/// pose between, latches the stop. A scan that is gone fails its job.
void on_storage_failed(const Setup& setup, State& state, Actions& actions, const StorageFailed& failed);

/// Notes what is free. Where files can be written again, what could not be remembered meanwhile is remembered
/// now, and the job is opened anew: only its journal knows what became of the pose in flight.
void on_disk_read(State& state, Actions& actions, const DiskRead& read);

/// Asks the storage to look where that is due.
void look_at_disk(State& state, Actions& actions);

}  // namespace rig::daemon
