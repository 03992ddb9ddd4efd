// How a job will go by if nothing goes wrong: its poses and the reference visits between them.
#pragma once

#include <string>

#include "core/machine/job_config.h"
#include "core/machine/rig_config.h"

namespace rig::machine {

/// What the course depends on beside rig.toml: what the drivers say of camera and light.
struct CourseDevices {
  double readout_s = 0;
  bool overlaps_motion = true;  ///< the camera reads out while the axes move
  bool has_shutter = true;      ///< of the light: a visit takes a dark frame
};

struct JobCourse {
  double travel_s = 0;    ///< with settling
  double exposing_s = 0;  ///< exposures and readouts, at most
  double duration_s = 0;  ///< of both; less than their sum where the camera reads out while the axes move
  int visits = 0;
  std::string unproven;  ///< why no visit can follow the last pose; empty: it can
  std::string
      unidentified;  ///< why the sample's fiducials cannot be looked for; empty: they can, or need not
};

/// From `start`, with the rig homed and the light warm. Visits are made when rig.toml says so, the first one
/// twice, and put off where the rig cannot go there, as rigd does it.
[[nodiscard]] JobCourse foresee(const RigConfig& rig, const CourseDevices& devices, const JobConfig& job,
                                const JointAngles& start);

/// Seconds of the longest bracket of a pose with the readouts between its frames.
[[nodiscard]] double bracket_s(const RigConfig& rig, double readout_s, const ExposureConfig& exposure,
                               const JointAngles& pose);

}  // namespace rig::machine
