// Orders to a drive that wait for its answer in the statusword, within the bound of a call.
#pragma once

#include "drivers/cia402_axis/drive.h"

namespace rig::drivers::cia402 {

using Deadline = Steady::time_point;

/// Leads the drive to operation enabled, one transition at a time: the next is ordered when the drive shows
/// that the one before is done. A fault, and a state that it does not leave, are `device` errors that name
/// it.
[[nodiscard]] base::Result<void> reach_operation(Drive& drive, Deadline deadline);

/// In operation enabled, or led back there from a quick stop. From elsewhere `refused`: nobody has enabled
/// it.
[[nodiscard]] base::Result<void> require_operation(Drive& drive, Deadline deadline);

/// A drive whose fault's cause lasts answers with a `device` error that names it.
[[nodiscard]] base::Result<void> reset_fault(Drive& drive, Deadline deadline);

/// Takes the motor's current.
[[nodiscard]] base::Result<void> let_motor_go(Drive& drive, Deadline deadline);

/// Selects a mode; a drive that does not show it is a `device` error.
[[nodiscard]] base::Result<void> require_mode(Drive& drive, std::int8_t mode, Deadline deadline);

/// Has the drive take the set-point that was written to its objects, at once and in place of an earlier one.
[[nodiscard]] base::Result<void> hand_over_set_point(Drive& drive, Deadline deadline);

}  // namespace rig::drivers::cia402
