// How a job will go by if nothing goes wrong: its poses and the reference visits between them.
#pragma once

#include <string>

#include "core/machine/job_config.h"
#include "daemon/state.h"

namespace rig::daemon {

struct JobCourse {
  double travel_s = 0;    ///< with settling
  double exposing_s = 0;  ///< exposures and readouts, at most
  double duration_s = 0;  ///< of both; less than their sum where the camera reads out while the axes move
  int visits = 0;
  std::string unproven;  ///< why no visit can follow the last pose; empty: it can
  std::string
      unidentified;  ///< why the sample's fiducials cannot be looked for; empty: they can, or need not
};

/// From `start`, with the rig homed and the light warm. Visits are made when rig.toml says so and put off
/// where the rig cannot go there, as visit.h does it.
[[nodiscard]] JobCourse foresee(const Setup& setup, const machine::JobConfig& job, const JointAngles& start);

}  // namespace rig::daemon
