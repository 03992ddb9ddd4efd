// What [module.settings] says of a pan-tilt unit.
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include "core/base/config.h"
#include "drivers/common/axis_settings.h"
#include "drivers/common/retry.h"
#include "drivers/common/serial_line.h"

namespace rig::drivers::ptu {

/// Of the unit's limits of travel, which counts.
enum class Limits { factory, user, off };

/// How one axis is reset. Manuals disagree on what RP and RT do.
enum class Reset {
  both,  ///< R, which resets both axes
  mode,  ///< RP or RT say what R resets, then R (D46, D300)
  axis,  ///< RP or RT reset that axis at once (E series)
};

struct UnitAxis {
  AxisSettings axis;                          ///< its scale's counts_per_rad is the unit's, once it was asked
  char letter = 'P';                          ///< 'P' or 'T'
  std::optional<double> counts_per_deg;       ///< as the owner believes it to be
  std::optional<double> base_velocity_rad_s;  ///< below which it starts without a ramp; absent: left as it is
  double user_min_rad = 0, user_max_rad = 0;  ///< with Limits::user
  std::string where;                          ///< of its table, for messages
};

struct Settings {
  SerialSettings serial;
  RetryPolicy retry;
  std::vector<UnitAxis> axes;  ///< one or two, no letter twice
  Limits limits = Limits::factory;
  Reset reset = Reset::both;
  bool low_hold_power = false;
  std::chrono::milliseconds reset_within{30000};   ///< the longest that a reset takes
  std::chrono::milliseconds tables_within{15000};  ///< the longest that a new acceleration takes
};

/// Errors are noted in the table.
[[nodiscard]] Settings read_settings(const base::ConfigTable& table);

}  // namespace rig::drivers::ptu
