// The shipped rig as step() sees it, and a job for it.
#pragma once

#include <string>
#include <vector>

#include "core/base/units.h"
#include "daemon/state.h"
#include "tests/core/machine/rig_file.h"

namespace rig::daemon::testing {

inline Setup small_setup() {
  Setup setup;
  setup.rig = machine::rig_with({});
  setup.camera = {1600, 1200, 12, "RGGB", 5e-5, 2, 0.5, true};
  setup.light = {true, true, 20};
  setup.version = "test";
  return setup;
}

/// A visit after every second pose.
inline machine::ReferenceConfig some_reference() {
  machine::ReferenceConfig reference;
  reference.pose_rad = {base::radians(5.0), base::radians(5.0), 0, base::radians(65.0)};
  reference.exposure_s = 0.02;
  reference.dark_exposure_s = 0.5;
  reference.every_poses = 2;
  return reference;
}

/// For some_reference().
inline machine::FlatConfig some_flat() {
  machine::FlatConfig flat;
  flat.pose_rad = {0, base::radians(12.0), 0, base::radians(60.0)};
  flat.exposure_s = 0.01;
  return flat;
}

/// Poses that the shipped rig can take one after the other.
inline std::vector<JointAngles> some_poses() {
  std::vector<JointAngles> poses;
  for (int i = 0; i < 5; ++i) {
    poses.push_back({base::radians(-20.0 + 11 * i), base::radians(10.0 - 4 * i), base::radians(6.0 * i - 12),
                     base::radians(60.0 + 9 * i)});
  }
  return poses;
}

inline machine::JobConfig small_job(std::size_t poses) {
  machine::JobConfig job;
  job.name = "small";
  job.sample = "none";
  job.poses = some_poses();
  job.poses.resize(poses);
  job.exposure.exposures_s = {0.16, 0.02};
  job.retry = {3, 1};
  return job;
}

/// Nothing going on, every axis at rest and read where some_poses()[pose] is.
inline State standing(bool homed, std::size_t pose) {
  State state;
  state.now = base::Time(base::seconds(1e6));
  state.look_at = state.now;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    state.axes[i].last.position_rad = some_poses()[pose][i];
    state.axes[i].last.homed = homed;
    state.axes[i].known = true;
  }
  return state;
}

}  // namespace rig::daemon::testing
