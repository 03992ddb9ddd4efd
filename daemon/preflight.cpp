#include "daemon/preflight.h"

#include <algorithm>

#include "core/machine/exposure_bounds.h"
#include "core/machine/job_course.h"
#include "core/machine/limits.h"
#include "core/machine/motion.h"
#include "core/machine/reference_looks.h"
#include "daemon/lamp.h"
#include "daemon/motion.h"
#include "daemon/space.h"

namespace rig::daemon {

namespace {

constexpr double kSecondsPerHour = 3600;

bool homed(const AxisTrack& axis) {
  return axis.known && axis.last.homed;
}

// Where the rig will stand when the job begins: where it stands now, or where homing ends.
JointAngles start_of(const Setup& setup, const State& state) {
  JointAngles start{};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    start[i] = homed(state.axes[i]) ? state.axes[i].last.position_rad : setup.rig.axes[i].home_rad;
  }
  return start;
}

// Jobs that come before this one leave the rig elsewhere.
bool begins_at_once(const State& state) {
  return !state.motion && std::none_of(state.jobs.begin(), state.jobs.end(), [](const JobEntry& job) {
    return job.state == JobEntry::State::active || job.state == JobEntry::State::queued;
  });
}

double homing_s(const Setup& setup, const State& state) {
  double sum = 0;
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!homed(state.axes[i])) sum += homing_time_s(setup, i);
  }
  return sum;
}

}  // namespace

protocol::Preflight preflight(const Setup& setup, const State& state, const machine::JobConfig& job) {
  protocol::Preflight flight;
  if (auto ok = machine::check_job(setup.rig, job); !ok) flight.add_problems(ok.error().text());
  const JointAngles start = start_of(setup, state);
  if (flight.problems().empty() && begins_at_once(state)) {
    if (auto ok = machine::check_move(setup.rig, start, job.poses.front()); !ok) {
      flight.add_problems("the way to the first pose: " + ok.error().text());
    }
  }
  const machine::CourseDevices devices{setup.camera.readout_s, setup.camera.overlaps_motion,
                                       setup.light.has_shutter};
  const machine::JobCourse course = machine::foresee(setup.rig, devices, job, start);
  // A lamp cools down while the axes are homed.
  const double dark_s = std::max(homing_s(setup, state), cool_down_left_s(setup, state));
  const double warm_up_s = state.light.warm ? 0 : setup.light.warm_up_s;
  const double duration_s = dark_s + warm_up_s + course.duration_s;
  const double lit_s = state.light.on ? duration_s : duration_s - dark_s;
  const auto poses = static_cast<double>(job.poses.size());
  const auto looks = machine::reference_looks(setup.rig, setup.light.has_shutter);
  const auto frames_of_visits = course.visits * static_cast<double>(looks.size());
  flight.set_poses(static_cast<std::uint32_t>(job.poses.size()));
  flight.set_frames(
      static_cast<std::uint32_t>(poses * machine::most_frames(job.exposure) + frames_of_visits));
  flight.set_travel_s(course.travel_s);
  flight.set_exposing_s(course.exposing_s);
  flight.set_duration_s(duration_s);
  flight.set_bytes_needed(
      static_cast<std::uint64_t>(poses * bytes_of_pose(setup, job) + course.visits * bytes_of_visit(setup)));
  flight.set_lamp_hours(state.light.hours + lit_s / kSecondsPerHour);
  flight.set_visits(static_cast<std::uint32_t>(course.visits));
  if (!course.unproven.empty())
    flight.add_warnings("no reference visit can follow the last pose: " + course.unproven);
  if (!course.unidentified.empty() && begins_at_once(state)) {
    flight.add_warnings(
        "the job will be held, because it cannot be checked which sample is on the carrier: " +
        course.unidentified);
  }
  const double life = setup.rig.unattended.lamp_life_hours;
  if (life > 0 && flight.lamp_hours() > life) {
    flight.add_problems(fmt::format(
        "the lamp has burnt {:.1f} hours and would have {:.1f} after the job; [light] life_hours is {:.0f}",
        state.light.hours, flight.lamp_hours(), life));
  }
  flight.set_ok(flight.problems().empty());
  return flight;
}

}  // namespace rig::daemon
