// step() from random states, with random requests and faults: what rigd promises holds after every step, and
// once the faults end every job comes to its end.
#include <cstdlib>
#include <gtest/gtest.h>
#include <limits>

#include "core/base/units.h"
#include "daemon/conditions.h"
#include "tests/core/seed.h"
#include "tests/daemon/rig_model.h"
#include "tests/daemon/small_setup.h"

namespace rig::daemon::testing {
namespace {

using base::seconds;

// Longer runs find rarer things; sanitizers make each round slower.
std::uint64_t rounds() {
  const char* wanted = std::getenv("RIG_TEST_ROUNDS");
  return wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : 200;
}

machine::JobConfig random_job(base::Random& random) {
  machine::JobConfig job = small_job(1 + random.below(5));
  const auto strategy = random.below(5);
  if (strategy == 0) {
    job.exposure = {};
    job.exposure.strategy = machine::ExposureStrategy::predicted;
    job.exposure.lightest_s = {0.02, 0.001};
    job.exposure.darkest_s = {0.5, 0.02};
    job.exposure.darkest_rad = base::radians(80);
  } else if (strategy == 1) {
    job.exposure = {};
    job.exposure.strategy = machine::ExposureStrategy::adaptive;
    job.exposure.first_s = 0.01;
    job.exposure.longest_s = 0.5;
    job.exposure.most_frames = static_cast<int>(1 + random.below(4));
    job.exposure.snr = random.uniform(5, 50);
    job.exposure.short_share = random.uniform(0, 0.2);
  } else if (strategy < 4) {
    job.exposure = {};
    job.exposure.strategy = machine::ExposureStrategy::halve;
    job.exposure.longest_s = 0.5;
    job.exposure.most_frames = static_cast<int>(1 + random.below(4));
    job.exposure.saturated_share = 0.4;
  }
  job.needs_sample_change = random.below(4) == 0;
  if (random.below(4) == 0) job.sample_fiducials = {static_cast<int>(random.below(4))};
  job.retry.attempts = static_cast<int>(1 + random.below(3));
  job.retry.delay_s = random.uniform(0, 2);
  return job;
}

State random_state(base::Random& random) {
  State state;
  state.now = base::Time(seconds(1e6));
  state.look_at = state.now;
  state.epoch = 1 + random.below(9);
  state.last_event = random.below(100);
  for (AxisTrack& axis : state.axes) {
    axis.last.position_rad = base::radians(random.uniform(10, 70));
    axis.last.homed = random.below(3) != 0;
    axis.last.enabled = random.below(2) == 0;
    axis.known = random.below(2) == 0;
  }
  if (random.below(3) == 0) state.stopped = "it was stopped before";
  return state;
}

std::string axis_name(base::Random& random) {
  return random.below(12) == 0 ? "elbow" : std::string(machine::kAxisNames[random.below(kAxisCount)]);
}

protocol::Request random_request(base::Random& random, std::size_t jobs) {
  protocol::Request request;
  switch (random.below(26)) {
    case 0:
      request.mutable_get_status();
      break;
    case 1:
      request.mutable_subscribe()->set_epoch(random.below(3));
      break;
    case 2:
      request.mutable_unsubscribe();
      break;
    case 3:
      request.mutable_home();
      break;
    case 4:
      request.mutable_home()->add_axes(axis_name(random));
      break;
    case 5:
    case 6:
    case 7: {
      auto& move = *request.mutable_move();
      for (std::uint64_t n = random.below(5); n > 0; --n) {
        auto& axis = *move.add_axes();
        axis.set_axis(axis_name(random));
        axis.set_angle_deg(random.below(20) == 0   ? std::numeric_limits<double>::quiet_NaN()
                           : random.below(10) == 0 ? random.uniform(-1e4, 1e4)
                                                   : random.uniform(-60, 170));
      }
      break;
    }
    case 8:
      request.mutable_stop()->set_reason(random.below(2) == 0 ? "" : "somebody came in");
      break;
    case 9:
    case 10:
    case 11:
      request.mutable_clear_stop();
      break;
    case 12: {
      auto& light = *request.mutable_set_light();
      if (random.below(2) == 0) light.set_on(random.below(2) == 0);
      if (random.below(2) == 0) light.set_shutter_open(random.below(2) == 0);
      if (random.below(2) == 0) light.set_level(random.uniform(-0.3, 1.3));
      break;
    }
    case 13:
      request.mutable_snap()->set_exposure_us(random.below(5) == 0 ? -1 : random.uniform(50, 2e6));
      break;
    case 14: {
      auto& submit = *request.mutable_submit_job();
      submit.set_job_toml(random.below(4) == 0 ? "nonsense = ["
                                               : machine::format_job_config(random_job(random), "a test"));
      submit.set_scan_folder(random.below(6) == 0 ? "relative" : "/scan");
      break;
    }
    case 15:
      request.mutable_list_jobs();
      break;
    case 16:
      request.mutable_show_job()->set_job(random.below(jobs + 2));
      break;
    case 17:
      if (random.below(3) == 0) request.mutable_abort_job()->set_job(random.below(jobs + 2));
      break;
    case 18:
      if (random.below(3) == 0) request.mutable_hold_job()->set_job(random.below(jobs + 2));
      break;
    case 19:
    case 20:
      request.mutable_release_job()->set_job(random.below(jobs + 2));
      break;
    case 22:
      request.mutable_check_job()->set_job_toml(machine::format_job_config(random_job(random), "a test"));
      break;
    case 25: {
      auto& jog = *request.mutable_jog();
      jog.set_axis(axis_name(random));
      jog.set_by_deg(random.below(10) == 0  ? std::numeric_limits<double>::quiet_NaN()
                     : random.below(5) == 0 ? random.uniform(-1e4, 1e4)
                                            : random.uniform(-12, 12));
      break;
    }
    case 23:
      request.mutable_get_report()->set_job(random.below(jobs + 2));
      break;
    case 21:
      request.mutable_reorder_job()->set_job(random.below(jobs + 2));
      request.mutable_reorder_job()->set_before(random.below(jobs + 2));
      break;
    default:
      break;  // no command
  }
  return request;
}

bool all_jobs_ended(const State& state) {
  for (const JobEntry& job : state.jobs) {
    if (job.state == JobEntry::State::queued || job.state == JobEntry::State::active) return false;
  }
  return true;
}

std::set<std::string> random_losses(base::Random& random) {
  std::set<std::string> gone;
  if (random.below(3) == 0) gone.insert("camera");
  if (random.below(3) == 0) gone.insert("axis " + axis_name(random));
  if (random.below(3) == 0) gone.insert("lines");
  return gone;
}

Faults random_faults(base::Random& random) {
  const auto sometimes = [&](double p) { return random.below(2) == 0 ? 0.0 : random.uniform(0, p); };
  Faults faults;
  faults.lost = sometimes(0.003);
  faults.refused = sometimes(0.003);
  faults.garbage = sometimes(0.003);
  faults.off_target = sometimes(0.2);
  faults.stuck = sometimes(0.02);
  faults.disk = sometimes(0.03);
  faults.damaged = sometimes(0.1);
  faults.busy = sometimes(0.3);
  faults.bad_visit = sometimes(0.3);
  faults.late_s = random.below(3) == 0 ? 1 : 0.01;
  return faults;
}

machine::LinesConfig random_lines(base::Random& random) {
  machine::LinesConfig lines;
  const machine::DeviceRef device{"virtual", "lines"};
  if (random.below(4) != 0) lines.emergency_stop = machine::LineRef{device, "emergency_stop"};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    for (std::size_t end = 0; end < kEnds; ++end) {
      if (random.below(2) == 0) lines.limit[i][end] = machine::LineRef{device, machine::limit_part(i, end)};
    }
  }
  return lines;
}

// Where the switches of limit lines stand: at the ends, or some near where the axis is, or even on it.
void place_switches(base::Random& random, const daemon::Setup& setup, RigModel& model, bool in_the_way) {
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    const machine::AxisConfig& axis = setup.rig.axes[i];
    constexpr double kBeyond_rad = 0.1;
    model.line_switch_rad[i] = {axis.min_rad - kBeyond_rad, axis.max_rad + kBeyond_rad};
    if (!in_the_way) continue;
    if (random.below(2) == 0)
      model.line_switch_rad[i][kLow] = model.place(i) - base::radians(random.uniform(-2, 20));
    if (random.below(2) == 0)
      model.line_switch_rad[i][kHigh] = model.place(i) + base::radians(random.uniform(-2, 20));
  }
}

std::string where_it_hangs(const State& state) {
  std::string text = "stopped: '" + state.stopped + "'";
  for (const JobEntry& job : state.jobs)
    text += fmt::format(", job {} in state {}, hold '{}'", job.id, static_cast<int>(job.state), job.hold);
  for (const ActiveCondition& on : active_conditions(state))
    text += fmt::format(", {}: {}", condition_name(on.condition), on.track->reason);
  if (!state.job) return text;
  const ActiveJob& job = *state.job;
  text += fmt::format(", phase {}, {} rows, current {}, storing {}, resting {}, recording {}, visits bad {}",
                      static_cast<int>(job.phase), job.rows.size(), job.current.has_value(),
                      job.storing.has_value(), job.resting, job.recording.has_value(), job.bad_visits);
  if (job.visit)
    text += fmt::format(", visit {} at stage {}", static_cast<int>(job.visit->kind),
                        static_cast<int>(job.visit->stage));
  return text;
}

TEST(StepFromRandomStates, KeepsItsPromises) {
  base::Random random(test::seed(20260101));
  std::size_t steps = 0;
  std::size_t frames = 0;
  std::size_t ran_in = 0;
  for (std::uint64_t round = 0; round < rounds(); ++round) {
    daemon::Setup setup = small_setup();
    setup.light.has_shutter = random.below(4) != 0;
    setup.rig.unattended.suspend.limit_s = random.below(2) == 0 ? 5 : 7200;
    setup.rig.unattended.suspend.person_limit_s = random.below(2) == 0 ? 5 : 43200;
    setup.rig.unattended.suspend.fail_at_limit = random.below(6) == 0;
    if (random.below(2) == 0) setup.rig.unattended.park_rad = some_poses()[1];
    setup.camera.overlaps_motion = random.below(3) != 0;
    if (random.below(2) == 0) setup.rig.unattended.reference = some_reference();
    if (setup.rig.unattended.reference && random.below(2) == 0)
      setup.rig.unattended.reference->flat = some_flat();
    if (random.below(2) == 0) setup.rig.lines = random_lines(random);
    // A reading may be late by one second in some rounds.
    setup.rig.deadlines.lines_s = 5;
    RigModel model(setup, random_state(random), random.bits());
    place_switches(random, setup, model, false);
    const std::uint64_t jobs = random.below(3);
    for (std::uint64_t id = 1; id <= jobs; ++id) {
      JobEntry entry;
      entry.id = id;
      entry.state = random.below(3) == 0 ? JobEntry::State::active : JobEntry::State::queued;
      model.add_job(entry, random_job(random));
    }
    model.faults = random_faults(random);
    model.refuses_jogs = random.below(4) == 0;
    double lamp = 1;  // what is left of the light's level
    model.on_light_read = [&lamp](drivers::LightState& light) { light.level *= lamp; };
    const double pause_s = random.below(2) == 0 ? 0.2 : 20;
    base::Time next_request = model.now();
    bool switches_in_the_way = true;
    const auto run = [&](bool calm, std::size_t most, const auto& until) {
      for (const std::size_t end = model.steps() + most; model.steps() < end && !until();) {
        const base::Time due = next_request;
        model.advance(due);
        if (model.now() < due) continue;
        next_request = model.now() + seconds(random.uniform(0, 2 * pause_s));
        if (random.below(4) == 0) place_switches(random, setup, model, switches_in_the_way);
        if (!calm) {
          if (random.below(40) == 0) model.emergency_stop = !model.emergency_stop;
          if (random.below(20) == 0) model.gone = random_losses(random);
          if (random.below(20) == 0) model.free_bytes = random.below(2) == 0 ? 1e6 : 1e12;
          if (random.below(20) == 0) lamp = random.below(2) == 0 ? 1 : random.uniform(0, 1.2);
          model.request(random_request(random, model.state().jobs.size()),
                        random.below(5) == 0 ? protocol::Role::observer : protocol::Role::operator_,
                        random.below(8) == 0 ? "another" : "operator");
        } else if (!model.state().stopped.empty()) {
          protocol::Request clear;
          clear.mutable_clear_stop();
          model.request(clear);
        } else {
          for (const JobEntry& job : model.state().jobs) {
            if (job.hold.empty() && !job.needs_sample_change) continue;
            protocol::Request release;
            release.mutable_release_job()->set_job(job.id);
            model.request(release);
          }
        }
        if (!model.broken().empty()) return;
      }
    };
    run(false, 2500, [] { return false; });
    model.faults = Faults{};
    model.emergency_stop = false;
    model.gone.clear();
    model.free_bytes = 1e12;
    lamp = 1;
    // The jobs go on, and every now and then a switch is in their way.
    run(true, 3000, [&] { return all_jobs_ended(model.state()); });
    switches_in_the_way = false;
    place_switches(random, setup, model, false);
    run(true, 200000, [&] {  // looks at limit lines are steps, too
      return all_jobs_ended(model.state()) && !model.state().motion && !model.state().snap && model.idle();
    });
    ASSERT_TRUE(model.broken().empty()) << "round " << round << ", " << model.broken().front();
    ASSERT_TRUE(all_jobs_ended(model.state()))
        << "round " << round << ": a job never ends: " << where_it_hangs(model.state());
    model.check_at_rest();
    ASSERT_TRUE(model.broken().empty()) << "round " << round << ", " << model.broken().front();
    steps += model.steps();
    for (const auto& event : model.events()) {
      frames += event.has_frame_taken() ? 1 : 0;
      ran_in += event.has_stop_latched() && event.stop_latched().reason().ends_with(" limit switch") ? 1 : 0;
    }
  }
  std::printf("%zu steps, %zu frames, %zu times into a limit switch\n", steps, frames, ran_in);
  EXPECT_GT(ran_in, rounds() / 20);
  EXPECT_GT(frames, rounds());  // the randomness must not keep everything from happening
}

}  // namespace
}  // namespace rig::daemon::testing
