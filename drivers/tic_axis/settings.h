// [module.settings] of this driver: docs/drivers/tic_axis.md lists every key.
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include "core/base/config.h"
#include "drivers/common/axis_settings.h"
#include "drivers/common/retry.h"
#include "drivers/tic_axis/transport.h"

namespace rig::drivers::tic {

enum class Homing {
  none,      ///< the axis is never homed by rigd
  forward,   ///< the Tic drives to its forward limit switch and off it again
  reverse,   ///< to its reverse one
  set_here,  ///< the axis is brought onto its switch by hand; that place becomes count 0
};
enum class Stop {
  halt,        ///< at once; steps may be lost, so the axis is not homed any more if it was moving
  decelerate,  ///< with the deceleration of the last move; the reference is kept
};

struct TicSettings {
  AxisSettings axis;
  Place place;
  int step_mode = 1;  ///< microsteps of a full step
  int current_limit_ma = 0;
  std::optional<int> command_timeout_ms;  ///< nothing: as the Tic has it
  Homing homing = Homing::none;
  bool switch_is_forward = false;  ///< of Homing::set_here
  Stop stop = Stop::halt;
  double min_vin_v = 0;  ///< a supply below this is a fault
};

struct ModuleSettings {
  RetryPolicy retry;
  std::chrono::milliseconds silence{2000};  ///< without a call, after which the command timeout is not fed
  bool write_settings = false;
  std::vector<TicSettings> tics;
};

/// Errors are noted in `settings`.
[[nodiscard]] ModuleSettings read_module_settings(const base::ConfigTable& settings);

/// Speeds and accelerations in the Tic's units, microsteps/10000 s and microsteps/s per 100 s, rounded down.
/// A speed is at least 1. One that the Tic cannot do (above 50000 microsteps/s; an acceleration below 1
/// microstep/s^2 or above 21 million) is bad_input.
[[nodiscard]] base::Result<std::uint32_t> tic_speed(const CountScale& scale, double rad_s);
[[nodiscard]] base::Result<std::uint32_t> tic_accel(const CountScale& scale, double rad_s2);

}  // namespace rig::drivers::tic
