// [module.settings] of a cia402_axis module. docs/drivers/cia402_axis.md is the list for people.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/config.h"
#include "drivers/common/axis_settings.h"
#include "drivers/common/retry.h"

namespace rig::drivers::cia402 {

struct NetworkSettings {
  std::string interface;                     ///< "can0", or "unix:/path"
  RetryPolicy retry;                         ///< of one SDO transfer, and how long a call may take
  std::chrono::milliseconds heartbeat{100};  ///< that drives are told to send; 0: none
  std::chrono::milliseconds heartbeat_timeout{300};
};

/// How an axis without an absolute encoder knows, of a drive it has just met, whether it was homed.
enum class Reference {
  absolute,        ///< the drive's own position is always good
  homing_mode,     ///< the drive shows "homing attained" whenever it is in homing mode
  statusword_bit,  ///< the drive shows it in a bit of its maker's
  session,         ///< it does not tell: only a homing since then counts
};

struct HomingSettings {
  std::int8_t method = 0;  ///< object 6098
  double speed_rad_s = 0;  ///< while it looks for the switch
  double creep_rad_s = 0;  ///< while it looks for the switch's edge
  double acceleration_rad_s2 = 0;
};

struct DriveSettings {
  AxisSettings axis;
  int node = 0;
  Reference reference = Reference::homing_mode;
  int referenced_bit = 0;                ///< of the statusword
  std::optional<HomingSettings> homing;  ///< always there but with an absolute reference
  bool limit_switches = true;            ///< object 60FD tells them
  bool limits_active_low = false;
  std::int16_t quick_stop_option = 6;  ///< object 605A; kLeaveOption: as the drive has it
  double quick_stop_rad_s2 = 0;        ///< object 6085
  bool stop_by_pdo = true;
  double velocity_unit = 1;      ///< of the drive, per count/s
  double acceleration_unit = 1;  ///< of the drive, per count/s^2
};
inline constexpr std::int16_t kLeaveOption = -1;

struct Settings {
  NetworkSettings network;
  std::vector<DriveSettings> drives;  ///< in the order of the file
};

/// Errors are noted in the table.
[[nodiscard]] Settings read_settings(const base::ConfigTable& table);

}  // namespace rig::drivers::cia402
