// What [module.settings] says of a 6000 controller.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/config.h"
#include "drivers/common/axis_settings.h"
#include "drivers/common/retry.h"
#include "drivers/common/serial_line.h"

namespace rig::drivers::sixk {

struct ControllerAxis {
  AxisSettings axis;  ///< its scale is of what the controller is commanded in
  int number = 1;     ///< 1 to 8, on the controller
  bool servo = false;
  bool hard_limits = true;
  std::optional<int> resolution;      ///< counts a turn of the motor; absent: the controller is asked
  std::optional<CountScale> encoder;  ///< of a stepper whose encoder is read instead of its counted steps
  bool home_upwards = false;          ///< the search sets out to positive angles
  double home_velocity_rad_s = 0;
  double home_acceleration_rad_s2 = 0;
  std::optional<double> home_final_velocity_rad_s;
  bool preset_at_home = false;  ///< the controller leaves its position as it is when it found home
};

struct Settings {
  SerialSettings serial;
  RetryPolicy retry;
  int unit = 0;         ///< address before each command; 0: none
  int error_level = 4;  ///< 4 or 1
  bool echo = false;
  bool kill = false;                ///< a stop is K, not S
  std::vector<std::string> set_up;  ///< commands of the owner, sent at each beginning
  std::vector<ControllerAxis> axes;
};

/// Errors are noted in the table.
[[nodiscard]] Settings read_settings(const base::ConfigTable& table);

}  // namespace rig::drivers::sixk
