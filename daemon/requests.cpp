#include "daemon/requests.h"

#include <algorithm>
#include <fmt/ranges.h>

#include "core/base/units.h"
#include "daemon/exposing.h"
#include "daemon/job.h"
#include "daemon/lamp.h"
#include "daemon/lease.h"
#include "daemon/messages.h"
#include "daemon/motion.h"
#include "daemon/preflight.h"
#include "daemon/queue.h"
#include "daemon/safety.h"

namespace rig::daemon {

using base::Result;
using protocol::Request;

namespace {

// Looking and stopping are for everyone.
bool needs_operator(const Request& request) {
  switch (request.command_case()) {
    case Request::kGetStatus:
    case Request::kSubscribe:
    case Request::kUnsubscribe:
    case Request::kStop:
    case Request::kListJobs:
    case Request::kShowJob:
    case Request::kGetControl:
    case Request::kCheckJob:
    case Request::kGetReport:
    case Request::kGetMetrics:
    case Request::kGetFrame:
      return false;
    default:
      return true;
  }
}

std::string why_busy(const State& state) {
  if (state.ending) return "rigd is ending";
  if (!state.stopped.empty())
    return fmt::format("the rig is stopped: {}; clear the stop first", state.stopped);
  if (state.job && !state.job->resting) return "a job is running; hold or abort it first";
  if (!state.lost.empty()) return "a device does not answer: " + state.lost.begin()->second;
  if (state.motion) return "the rig is moving";
  if (state.snap) return "the camera is exposing";
  return {};
}

std::optional<std::size_t> axis_named(const std::string& name) {
  const auto found = std::find(machine::kAxisNames.begin(), machine::kAxisNames.end(), name);
  if (found == machine::kAxisNames.end()) return std::nullopt;
  return static_cast<std::size_t>(found - machine::kAxisNames.begin());
}

constexpr int kLeastPreview = 16;
constexpr int kMostPreview = 2000;

int preview_width(std::uint32_t asked) {
  if (asked == 0) return protocol::PreviewWish{}.width;
  return static_cast<int>(std::clamp<std::uint32_t>(asked, kLeastPreview, kMostPreview));
}

std::optional<protocol::PreviewWish> preview_wish(const protocol::Subscribe& command) {
  if (!command.previews()) return std::nullopt;
  return protocol::PreviewWish{preview_width(command.preview_width()),
                               std::chrono::milliseconds(command.preview_every_ms())};
}

// One request at work: what it needs, and its answer.
struct Work {
  const Setup& setup;
  State& state;
  Actions& actions;
  Asker asker;

  void answer(protocol::Outcome outcome, const std::string& reason = {}) const {
    actions.push_back(SendReply{asker.client, make_reply(asker.id, outcome, reason)});
  }
  void answer(protocol::Reply reply) const { actions.push_back(SendReply{asker.client, std::move(reply)}); }
  void refuse(const std::string& reason) const { answer(protocol::REFUSED, reason); }
};

void get_status(const Work& w) {
  auto reply = make_reply(w.asker.id, protocol::DONE);
  *reply.mutable_status() = make_status(w.setup, w.state);
  w.answer(std::move(reply));
}

void home(const Work& w, const protocol::Home& command) {
  if (const auto busy = why_busy(w.state); !busy.empty()) return w.refuse(busy);
  if (w.state.emergency_stop) return w.refuse("the emergency stop is active");
  std::vector<std::size_t> axes;
  for (const std::string& name : command.axes()) {
    const auto axis = axis_named(name);
    if (!axis) return w.refuse(fmt::format("there is no axis '{}'", name));
    axes.push_back(*axis);
  }
  if (axes.empty()) axes.assign(w.setup.rig.home_order.begin(), w.setup.rig.home_order.end());
  begin_homing(w.setup, w.state, w.actions, std::move(axes), w.asker);
}

void move(const Work& w, const protocol::Move& command) {
  if (const auto busy = why_busy(w.state); !busy.empty()) return w.refuse(busy);
  std::array<bool, kAxisCount> involved{};
  JointAngles target{};
  for (const auto& named : command.axes()) {
    const auto axis = axis_named(named.axis());
    if (!axis) return w.refuse(fmt::format("there is no axis '{}'", named.axis()));
    if (involved[*axis]) return w.refuse(fmt::format("axis {} is named twice", named.axis()));
    involved[*axis] = true;
    target[*axis] = base::radians(named.angle_deg());
  }
  if (command.axes().empty()) return w.refuse("no axis is named");
  if (auto ok = begin_move(w.setup, w.state, w.actions, involved, target, w.asker); !ok)
    w.refuse(ok.error().text());
}

void jog(const Work& w, const protocol::Jog& command) {
  if (const auto busy = why_busy(w.state); !busy.empty()) return w.refuse(busy);
  const auto axis = axis_named(command.axis());
  if (!axis) return w.refuse(fmt::format("there is no axis '{}'", command.axis()));
  const double by_rad = base::radians(command.by_deg());
  const drivers::AxisState& here = w.state.axes[*axis].last;
  Result<void> begun;
  if (here.homed) {
    std::array<bool, kAxisCount> involved{};
    JointAngles target{};
    involved[*axis] = true;
    target[*axis] = here.position_rad + by_rad;
    begun = begin_move(w.setup, w.state, w.actions, involved, target, w.asker);
  } else {
    begun = begin_jog(w.setup, w.state, w.actions, *axis, by_rad, w.asker);
  }
  if (!begun) w.refuse(begun.error().text());
}

void set_light(const Work& w, const protocol::SetLight& command) {
  if (w.state.job && !w.state.job->resting) return w.refuse("a job is running and needs the light");
  const bool waits_for_light = w.state.conditions[static_cast<std::size_t>(Condition::light)].on;
  if (w.state.job && waits_for_light && find_job(w.state, w.state.job->id)->hold.empty())
    return w.refuse("the job waits for the light; hold it first, then set the light by hand");
  const bool lights_up = (command.has_shutter_open() && command.shutter_open()) ||
                         (command.has_on() && command.on()) || (command.has_level() && command.level() > 0);
  if (lights_up && !w.state.stopped.empty()) return w.refuse("the rig is stopped; clear the stop first");
  const bool lights_lamp = (command.has_on() && command.on()) || (command.has_level() && command.level() > 0);
  if (const double left_s = cool_down_left_s(w.setup, w.state); lights_lamp && left_s > 0)
    return w.refuse(fmt::format("the lamp has to cool down for {:.0f} s more", left_s));
  if (command.has_level() && !(command.level() >= 0 && command.level() <= 1))
    return w.refuse("a level is 0 to 1");
  if (command.has_level() && !w.setup.light.has_level && command.level() != 0 && command.level() != 1) {
    return w.refuse("this light knows only 0 and 1");
  }
  if (command.has_shutter_open() && !w.setup.light.has_shutter) return w.refuse("this light has no shutter");
  if (command.has_on()) w.actions.push_back(SetLightLevel{command.on() ? 1.0 : 0.0});
  if (command.has_level()) w.actions.push_back(SetLightLevel{command.level()});
  if (command.has_shutter_open()) w.actions.push_back(SetShutter{command.shutter_open()});
  w.actions.push_back(PollLight{++w.state.last_poll});
  w.answer(protocol::DONE);
}

void snap(const Work& w, const protocol::Snap& command) {
  if (const auto busy = why_busy(w.state); !busy.empty()) return w.refuse(busy);
  const double exposure_s = command.exposure_us() * 1e-6;
  if (!(exposure_s >= w.setup.rig.camera.min_exposure_s && exposure_s <= w.setup.rig.camera.max_exposure_s)) {
    return w.refuse(fmt::format("the camera exposes for {:.0f} to {:.0f} us",
                                w.setup.rig.camera.min_exposure_s * 1e6,
                                w.setup.rig.camera.max_exposure_s * 1e6));
  }
  w.state.snap = Snap{w.asker, command.full(), preview_width(command.preview_width())};
  w.actions.push_back(ArmCamera{});
  trigger_camera(w.setup, w.state, w.actions, exposure_s, -1, 0);
}

void get_frame(const Work& w, const protocol::GetFrame& command) {
  const JobEntry* job = find_job(w.state, command.job());
  if (job == nullptr) return w.refuse(fmt::format("there is no job {}", command.job()));
  w.actions.push_back(SendFramePiece{w.asker, job->scan_folder, command});
}

void submit_job(const Work& w, const protocol::SubmitJob& command) {
  if (w.state.ending) return w.refuse("rigd is ending");
  if (command.scan_folder().empty() || command.scan_folder()[0] != '/') {
    return w.refuse("the scan folder must be an absolute path");
  }
  const auto job = machine::parse_job_config(command.job_toml(), command.job_name());
  if (!job) return w.refuse(job.error().text());
  const auto flight = preflight(w.setup, w.state, *job);
  if (!flight.problems().empty()) {
    return w.refuse(fmt::format("{}", fmt::join(flight.problems().begin(), flight.problems().end(), "; ")));
  }
  const double margin = w.setup.rig.unattended.suspend.disk_margin_bytes;
  w.actions.push_back(CreateJob{w.asker, command, static_cast<double>(flight.bytes_needed()) + margin});
}

void check_job(const Work& w, const protocol::CheckJob& command) {
  if (!command.scan_folder().empty() && command.scan_folder()[0] != '/') {
    return w.refuse("the scan folder must be an absolute path");
  }
  const auto job = machine::parse_job_config(command.job_toml(), command.job_name());
  if (!job) return w.refuse(job.error().text());
  w.actions.push_back(CheckSpace{w.asker, preflight(w.setup, w.state, *job), command.scan_folder(),
                                 w.setup.rig.unattended.suspend.disk_margin_bytes});
}

void get_report(const Work& w, std::uint64_t id) {
  const JobEntry* job = find_job(w.state, id);
  if (job == nullptr) return w.refuse(fmt::format("there is no job {}", id));
  w.actions.push_back(SendReport{w.asker, make_job_info(w.state, *job)});
}

// Of what is done or refused at once.
void answer_with(const Work& w, const Result<void>& done) {
  if (!done) return w.refuse(done.error().text());
  w.answer(protocol::DONE);
}

void list_jobs(const Work& w) {
  auto reply = make_reply(w.asker.id, protocol::DONE);
  auto& list = *reply.mutable_jobs();
  for (const JobEntry& job : w.state.jobs) *list.add_jobs() = make_job_info(w.state, job);
  w.answer(std::move(reply));
}

void show_job(const Work& w, std::uint64_t id) {
  for (const JobEntry& job : w.state.jobs) {
    if (job.id != id) continue;
    auto reply = make_reply(w.asker.id, protocol::DONE);
    *reply.mutable_job() = make_job_info(w.state, job);
    return w.answer(std::move(reply));
  }
  w.refuse(fmt::format("there is no job {}", id));
}

void abort_job(const Work& w, std::uint64_t id) {
  for (const JobEntry& job : w.state.jobs) {
    if (job.id != id) continue;
    if (job.state != JobEntry::State::queued && job.state != JobEntry::State::active) {
      return w.refuse(fmt::format("job {} has ended", id));
    }
    end_job(w.setup, w.state, w.actions, id, JobEntry::State::aborted, "aborted by an operator");
    return w.answer(protocol::DONE);
  }
  w.refuse(fmt::format("there is no job {}", id));
}

}  // namespace

void on_request(const Setup& setup, State& state, Actions& actions, const RequestReceived& received) {
  const Request& request = received.request;
  const Work w{setup, state, actions, {received.client, request.id()}};
  hear(setup, state, actions, received);
  if (received.role == protocol::Role::observer && needs_operator(request)) {
    return w.refuse("this connection may look and stop, not command");
  }
  if (is_about_control(request)) return on_control_request(setup, state, actions, received);
  if (needs_operator(request)) {
    if (auto ok = use_control(state, actions, received); !ok) return w.refuse(ok.error().text());
  }
  switch (request.command_case()) {
    case Request::kGetStatus:
      return get_status(w);
    case Request::kSubscribe:
      actions.push_back(SubscribeClient{w.asker, request.subscribe().epoch(), request.subscribe().after(),
                                        preview_wish(request.subscribe())});
      return;
    case Request::kUnsubscribe:
      actions.push_back(UnsubscribeClient{w.asker.client});
      return w.answer(protocol::DONE);
    case Request::kHome:
      return home(w, request.home());
    case Request::kMove:
      return move(w, request.move());
    case Request::kJog:
      return jog(w, request.jog());
    case Request::kStop:
      stop_everything(setup, state, actions,
                      request.stop().reason().empty() ? "asked by a client" : request.stop().reason());
      return w.answer(protocol::DONE);
    case Request::kClearStop:
      if (auto ok = clear_stop(state, actions); !ok) return w.refuse(ok.error().text());
      return w.answer(protocol::DONE);
    case Request::kSetLight:
      return set_light(w, request.set_light());
    case Request::kSnap:
      return snap(w, request.snap());
    case Request::kSubmitJob:
      return submit_job(w, request.submit_job());
    case Request::kListJobs:
      return list_jobs(w);
    case Request::kShowJob:
      return show_job(w, request.show_job().job());
    case Request::kAbortJob:
      return abort_job(w, request.abort_job().job());
    case Request::kHoldJob:
      return answer_with(w, hold_job(state, actions, request.hold_job().job(), request.hold_job().reason()));
    case Request::kReleaseJob:
      return answer_with(w, release_job(state, actions, request.release_job().job()));
    case Request::kReorderJob:
      return answer_with(
          w, reorder_job(state, actions, request.reorder_job().job(), request.reorder_job().before()));
    case Request::kCheckJob:
      return check_job(w, request.check_job());
    case Request::kGetReport:
      return get_report(w, request.get_report().job());
    case Request::kGetFrame:
      return get_frame(w, request.get_frame());
    case Request::kGetMetrics:
      actions.push_back(ReplyWithMetrics{w.asker});
      return;
    default:
      return w.refuse("the request has no command that is known here");
  }
}

void on_job_created(State& state, Actions& actions, const JobCreated& created) {
  if (!created.entry) {
    actions.push_back(SendReply{
        created.asker.client, make_reply(created.asker.id, protocol::FAILED, created.entry.error().text())});
    return;
  }
  state.jobs.push_back(*created.entry);
  auto reply = make_reply(created.asker.id, protocol::DONE);
  *reply.mutable_job() = make_job_info(state, *created.entry);
  actions.push_back(SendReply{created.asker.client, std::move(reply)});
  publish_job(state, actions, *created.entry);
}

}  // namespace rig::daemon
