// Setting up one axis with a person beside the rig: which way it turns, how far, between which ends.
#pragma once

#include <string>
#include <unistd.h>

#include "clients/rig/commands.h"

namespace rig::client {

struct AxisSetupOptions {
  std::string axis;
  std::string config;     ///< rig.toml, the one that rigd was started with
  double jog_deg = 2;     ///< to see the direction
  double scale_deg = 20;  ///< to measure the scale
  double step_deg = 5;    ///< towards the ends
  int answers = STDIN_FILENO;
};

/// Asks, moves as it is told, and at the end changes `config` if the person agrees. Moves by rigd's own Jog,
/// Home and Move, each after a yes; once homed rigd's limits and keep-out zones hold.
[[nodiscard]] Result<void> axis_setup(const Connection& to, const AxisSetupOptions& options);

}  // namespace rig::client
