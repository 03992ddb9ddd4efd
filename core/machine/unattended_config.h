// What rig.toml says about a rig that nobody watches: when jobs are suspended, whom to tell, where to park.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/config.h"
#include "core/machine/pose.h"
#include "core/machine/reference_config.h"

namespace rig::machine {

/// [suspend]: when rigd suspends a job by itself, and for how long.
struct SuspendConfig {
  double light_band = 0.05;                 ///< farthest that the light's level may be from 1
  double disk_margin_bytes = 500e6;         ///< to stay free beyond what the rest of the job needs
  std::optional<double> max_temperature_c;  ///< of any device that tells its temperature
  double limit_s = 7200;                    ///< longest wait for the rig, by one condition, rig time
  double person_limit_s = 43200;            ///< longest wait for a person: a stop, a hold, a change of sample
  bool fail_at_limit = false;               ///< then the job fails; else it is held for an operator
};

/// [notify]: the program that is told when a job is suspended and when it ends.
struct NotifyConfig {
  std::vector<std::string> command;  ///< program and arguments, run without a shell; empty: nobody is told
  double timeout_s = 30;             ///< wall time; then it is killed
};

struct UnattendedConfig {
  SuspendConfig suspend;
  NotifyConfig notify;
  std::optional<JointAngles> park_rad;  ///< where an aborted job leaves the axes; none: where they stopped
  double lamp_life_hours = 0;           ///< [light] life_hours; 0: not stated
  std::optional<ReferenceConfig> reference;
};

/// Reads [suspend], [notify], [park], [reference] and [light] life_hours; mistakes are noted in the tables.
[[nodiscard]] UnattendedConfig read_unattended(const base::ConfigTable& root);

}  // namespace rig::machine
