#include "daemon/step.h"

#include <algorithm>
#include <cmath>

#include "daemon/conditions.h"
#include "daemon/disk.h"
#include "daemon/exposing.h"
#include "daemon/frame_check.h"
#include "daemon/job.h"
#include "daemon/lamp.h"
#include "daemon/lease.h"
#include "daemon/lines.h"
#include "daemon/messages.h"
#include "daemon/motion.h"
#include "daemon/queue.h"
#include "daemon/reference_visit.h"
#include "daemon/requests.h"
#include "daemon/safety.h"
#include "daemon/visit.h"

namespace rig::daemon {

using base::seconds;

namespace {

constexpr double kLookEvery_s = 0.5;   // at the lines, the light and resting axes
constexpr double kCameraEvery_s = 10;  // at the camera's temperature
constexpr double kFetchAgain_s = 0.005;
constexpr double kFetchPatience = 2;  // of its deadline: a fetch may wait for other calls to the camera

// One handler a kind of event.
struct Handler {
  const Setup& setup;
  State& state;
  Actions& actions;

  void operator()(const Tick& /*event*/) const {}

  void operator()(const RequestReceived& event) const { on_request(setup, state, actions, event); }

  void operator()(const AxisPolled& event) const {
    state.lost.erase(fmt::format("axis {}", machine::kAxisNames[event.axis]));
    if (const auto end = on_axis_polled(setup, state, actions, event)) tell_end(*end);
  }

  void operator()(const JogRefused& event) const {
    if (const auto end = on_jog_refused(state, event)) tell_end(*end);
  }

  void tell_end(const MotionEnd& end) const {
    if (!end.asker) return on_job_motion_end(setup, state, actions, end);
    const auto outcome = end.refused           ? protocol::REFUSED
                         : end.failure.empty() ? protocol::DONE
                                               : protocol::FAILED;
    actions.push_back(SendReply{end.asker->client, make_reply(end.asker->id, outcome, end.failure)});
  }

  void operator()(const LightPolled& event) const {
    if (!std::isfinite(event.state.level) || !std::isfinite(event.state.hours)) {
      state.light_known = false;
      if (state.stopped.empty()) stop_everything(setup, state, actions, "the light reports no level");
      return;
    }
    const drivers::LightState& before = state.light;
    const bool changed = !state.light_known || before.on != event.state.on ||
                         before.level != event.state.level ||
                         before.shutter_open != event.state.shutter_open || before.warm != event.state.warm;
    note_lamp(state, event.state);
    state.light = event.state;
    state.lost.erase("light");
    state.light_known = true;
    state.light_read = event.number;
    if (!event.state.fault.empty() && state.stopped.empty()) {
      stop_everything(setup, state, actions, "the light: " + event.state.fault);
    }
    if (!changed) return;
    protocol::Event told;
    *told.mutable_light_changed()->mutable_light() = make_light_status(event.state);
    publish(state, actions, std::move(told));
  }

  void operator()(const LinesRead& event) const { on_lines_read(setup, state, actions, event); }

  void operator()(const DeviceFailed& event) const {
    forget_limit_lines(setup, state, event.device);
    if (event.transient) {
      // Once: what it is asked while it is away fails too.
      if (!state.lost.emplace(event.device, event.what).second) return;
      for (std::size_t i = 0; i < kAxisCount; ++i) {
        if (event.device == fmt::format("axis {}", machine::kAxisNames[i])) state.axes[i].known = false;
      }
      drop_all(setup, state, actions, event.what);
      return;
    }
    if (state.stopped.empty()) {
      stop_everything(setup, state, actions, event.what);
      return;
    }
    if (event.what == state.last_alarm) return;  // a device that is gone says so at every look
    state.last_alarm = event.what;
    publish_alarm(state, actions, event.what);
  }

  void operator()(const CameraTriggered& event) const { on_camera_triggered(setup, state, event); }

  void operator()(const CameraBusy& event) const { on_camera_busy(setup, state, actions, event); }

  void operator()(const FrameDamaged& event) const {
    state.lost.erase("camera");
    if (!state.frame || state.frame->exposure != event.exposure) return;  // of something that was stopped
    refuse_frame(setup, state, actions, event.what);
  }

  void operator()(const FrameNotReady& event) const {
    if (!state.frame || state.frame->exposure != event.exposure) return;
    state.frame->fetching = false;
    state.frame->fetch_at = state.now + seconds(kFetchAgain_s);
    if (state.now > state.frame->deadline)
      refuse_frame(setup, state, actions, "the camera delivered none in time");
  }

  void operator()(const FrameFetched& event) const {
    state.lost.erase("camera");
    if (!state.frame || state.frame->exposure != event.exposure) {
      actions.push_back(ReleaseFrame{event.slot});  // of something that was stopped
      return;
    }
    const PendingFrame pending = *state.frame;
    if (const std::string refused = why_refused(state, pending, event); !refused.empty()) {
      actions.push_back(ReleaseFrame{event.slot});
      refuse_frame(setup, state, actions, refused);
      return;
    }
    state.frame.reset();
    state.last_frame = event.info.counter;
    state.frames_refused = 0;
    if (pending.row == kSnapRow && state.snap) {
      actions.push_back(ReplyWithFrame{state.snap->asker, event.slot, event.info, event.saturated_share,
                                       state.snap->full, state.snap->preview_width});
      state.snap.reset();
    } else if (pending.row >= 0 && state.job) {
      on_job_frame(state, actions, pending, event);
    } else if (pending.row == kVisitRow) {
      on_visit_frame(setup, state, actions, event);
    } else {
      actions.push_back(ReleaseFrame{event.slot});
    }
  }

  void operator()(const LookJudged& event) const { on_look_judged(setup, state, actions, event); }
  void operator()(const VisitRecorded& event) const { on_visit_recorded(setup, state, actions, event); }
  void operator()(const FrameStored& event) const { on_frame_stored(state, event); }
  void operator()(const PoseCommitted& event) const { on_pose_committed(setup, state, actions, event); }
  void operator()(const JobCreated& event) const { on_job_created(state, actions, event); }
  void operator()(const JobOpened& event) const { on_job_opened(setup, state, actions, event); }

  // The job stays active: once its cause is mended and the stop is cleared, it goes on.
  void operator()(const StorageFailed& event) const { on_storage_failed(setup, state, actions, event); }
  void operator()(const CameraAnswered& /*event*/) const { state.lost.erase("camera"); }
  void operator()(const CameraTemperatureRead& event) const {
    state.camera_temperature_c = event.temperature_c;
  }
  void operator()(const DiskRead& event) const { on_disk_read(state, actions, event); }
  void operator()(const ClientRevoked& event) const { on_client_revoked(state, actions, event); }
  void operator()(const Heartbeat& /*event*/) const {}  // that step() ran is the answer
  void operator()(const StatisticsDue& /*event*/) const { actions.push_back(LogStatistics{}); }

  void operator()(const EndRequested& /*event*/) const {
    if (state.ending) return;
    state.ending = true;
    drop_all(setup, state, actions, "rigd is ending");
    state.job.reset();
  }
};

void look_around(const Setup& setup, State& state, Actions& actions) {
  if (state.now < state.look_at) return;
  state.look_at = state.now + seconds(kLookEvery_s);
  ask_lines(setup, state, actions);
  actions.push_back(PollLight{++state.last_poll});
  if (state.lost.count("camera") != 0) {
    actions.push_back(ProbeCamera{});
  } else if (state.now >= state.camera_look_at) {
    state.camera_look_at = state.now + seconds(kCameraEvery_s);
    actions.push_back(ReadCameraTemperature{});
  }
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    // Moving ones too: they must be seen on their way.
    actions.push_back(PollAxis{i, ++state.last_poll});
  }
}

void fetch_frame(const Setup& setup, State& state, Actions& actions) {
  trigger_again(setup, state, actions);
  if (!state.frame || state.frame->again) return;
  if (state.frame->fetching || !state.frame->exposing) {
    if (state.now >= state.frame->answer_by)
      stop_everything(setup, state, actions, "the camera does not answer");
    return;
  }
  if (state.now < state.frame->fetch_at) return;
  state.frame->fetching = true;
  state.frame->answer_by = state.now + seconds(kFetchPatience * setup.rig.deadlines.frame_s);
  JointAngles angles{};
  for (std::size_t i = 0; i < kAxisCount; ++i) angles[i] = state.axes[i].last.position_rad;
  // The rig may be on its way to the next pose already; the frame shows where it stood.
  if (state.job && state.frame->row >= 0) {
    for (const auto& take : {state.job->current, state.job->storing}) {
      if (take && take->row == state.frame->row) angles = take->target_rad;
    }
  }
  const bool adaptive = state.frame->row >= 0 && state.job && state.job->config &&
                        state.job->config->exposure.strategy == machine::ExposureStrategy::adaptive;
  actions.push_back(FetchFrame{angles, state.frame->exposure, adaptive});
}

}  // namespace

Step step(const Setup& setup, State state, const Event& event) {
  Step out{std::move(state), {}};
  out.state.now = std::max(out.state.now, event.time);
  out.state.wall = std::max(out.state.wall, event.wall);
  const auto mode = mode_of(out.state);
  std::visit(Handler{setup, out.state, out.actions}, event.what);
  end_pause_after_bad_visit(out.state);
  watch_conditions(setup, out.state, out.actions);
  advance_parking(setup, out.state, out.actions);
  release_silent(setup, out.state, out.actions);
  advance_job(setup, out.state, out.actions);
  poll_motion(setup, out.state, out.actions);
  watch_limit_lines(setup, out.state, out.actions);
  fetch_frame(setup, out.state, out.actions);
  look_around(setup, out.state, out.actions);
  look_at_disk(out.state, out.actions);
  if (const auto now = mode_of(out.state); now != mode) {
    protocol::Event changed;
    changed.mutable_mode_changed()->set_mode(now);
    publish(out.state, out.actions, std::move(changed));
  }
  return out;
}

std::optional<Wake> next_wake(const State& state) {
  Wake wake{state.look_at, base::WaitFor::person};
  const auto consider = [&wake](Time at) {
    wake.kind = base::WaitFor::rig;
    wake.at = std::min(wake.at, at);
  };
  if (state.motion) {
    consider(answers_awaited(*state.motion) ? state.motion->answer_by : state.motion->poll_at);
    if (state.motion->lines_at) consider(*state.motion->lines_at);
  }
  if (state.frame) {
    const PendingFrame& frame = *state.frame;
    if (frame.exposing && state.now < frame.exposed) consider(frame.exposed);
    consider(frame.again                         ? *frame.again
             : frame.fetching || !frame.exposing ? frame.answer_by
                                                 : frame.fetch_at);
  }
  if (state.job) {
    const bool suspended = state.job->suspended;
    if (state.job->not_before > state.now && !suspended) consider(state.job->not_before);
    // A lamp that warms up is waited for at the rig's pace, look by look; so is what suspends a job, unless a
    // person has to end it.
    const bool looks = state.job->phase != ActiveJob::Phase::running || state.job->visit;
    if (suspended ? waits_for_rig(state) : looks) wake.kind = base::WaitFor::rig;
  }
  if (state.parking) wake.kind = base::WaitFor::rig;
  return wake;
}

}  // namespace rig::daemon
