// What is to go wrong in the virtual rig: read from [module.settings.faults], or from a file of the same
// keys.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/base/config.h"

namespace rig::sim {

enum class FaultKind {
  stall,             ///< a move ends part of the way and the drive goes on pushing
  lost_steps,        ///< a move after which the axis truly stands elsewhere than its readback says
  backlash,          ///< more of it
  limit_switch,      ///< of the drive: reads active wherever the axis stands
  limit_line,        ///< likewise one that is wired to the lines
  emergency_stop,    ///< somebody presses it
  slow,              ///< a call that returns late
  garbage,           ///< a reply whose values are no numbers
  lost,              ///< calls that fail with an error of the device
  unplugged,         ///< calls that say lost: the device is gone and may come back
  dropped_frame,     ///< an exposure whose frame never comes
  corrupt_frame,     ///< lines of zeros, or samples beyond the sensor's bits
  incomplete_frame,  ///< a frame of which a part never came: the camera says so
  busy_camera,       ///< an exposure that was aborted goes on for a while
  light_fails,       ///< the lamp goes out and says so
  light_drift,       ///< the light depends on the angles that were asked for
  light_excursion,   ///< the light gives more or less than its level
  clock_step,        ///< time jumps forward, or the machine's clock is set back
  disk_full,         ///< no file grows
};

struct Fault {
  FaultKind kind = FaultKind::stall;
  std::string device;     ///< "roll" ... "arm", "camera", "light", "lines"; empty: every one that can have it
  bool high_side = true;  ///< of the limit switch or line
  double amount = 0;      ///< radians, seconds or a share, as the kind has it
  double from_s = 0;      ///< since the world was made, in the rig's time
  double until_s = std::numeric_limits<double>::infinity();
  double chance = 1;                                                ///< of each occasion within that time
  std::uint64_t after = 0;                                          ///< occasions that pass first
  std::uint64_t times = std::numeric_limits<std::uint64_t>::max();  ///< at most
};

struct FaultPlan {
  std::uint64_t seed = 0;
  std::vector<Fault> faults;
};

/// Reads `seed` and the tables `fault`; mistakes are noted in the table.
[[nodiscard]] FaultPlan read_fault_plan(const base::ConfigTable& table);

}  // namespace rig::sim
