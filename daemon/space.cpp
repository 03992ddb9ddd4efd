#include "daemon/space.h"

#include <algorithm>
#include <cmath>

#include "core/machine/exposure_bounds.h"
#include "core/machine/job_course.h"
#include "core/machine/reference_looks.h"

namespace rig::daemon {

namespace {

constexpr double kBytesPerSample = 2;
constexpr double kHeader_bytes = 4096;   // of a frame's file, and what is left of its last block
constexpr double kJournal_bytes = 8192;  // of a pose or a visit, with its events
constexpr double kJournalFrame_bytes = 512;

double bytes_of_frames(const Setup& setup, double frames) {
  const auto& size = setup.rig.camera.intrinsics;
  const double frame = kBytesPerSample * static_cast<double>(size.width) * static_cast<double>(size.height) +
                       kHeader_bytes + kJournalFrame_bytes;
  return frames * frame + kJournal_bytes;
}

// At most one between two poses, the one that is due, and the last.
double visits_left(const Setup& setup, const ActiveJob& job, double poses) {
  const auto& reference = setup.rig.unattended.reference;
  if (!reference) return 0;
  double between = 0;
  if (reference->every_poses > 0) between += std::floor(poses / reference->every_poses);
  if (reference->every_s > 0) {
    // Before the first commit the camera's time is all that is known of the pace.
    const double pose_s =
        job.rows.empty() ? job.seconds_per_pose
                         : std::max(job.seconds_per_pose,
                                    machine::bracket_s(setup.rig, setup.camera.readout_s,
                                                       job.config->exposure, job.rows.front().target_rad));
    between += std::floor(poses * pose_s / reference->every_s);
  }
  const double due = job.visits.first || job.rival ? 1 : 2;  // the first is repeated
  return std::min(between, poses) + (job.reference_due ? due : 0) + 1;
}

}  // namespace

double bytes_of_pose(const Setup& setup, const machine::JobConfig& job) {
  return bytes_of_frames(setup, machine::most_frames(job.exposure));
}

double bytes_of_visit(const Setup& setup) {
  const auto looks = machine::reference_looks(setup.rig, setup.light.has_shutter);
  return looks.empty() ? 0 : bytes_of_frames(setup, static_cast<double>(looks.size()));
}

double bytes_left_to_write(const Setup& setup, const State& state) {
  if (!state.job || !state.job->config) return 0;
  const ActiveJob& job = *state.job;
  const auto poses = static_cast<double>(job.rows.size() + (job.current ? 1U : 0U) + (job.storing ? 1U : 0U));
  return poses * bytes_of_pose(setup, *job.config) + visits_left(setup, job, poses) * bytes_of_visit(setup);
}

}  // namespace rig::daemon
