#include "daemon/loop.h"

#include "core/base/log.h"
#include "core/machine/kinematics.h"
#include "daemon/frame_check.h"
#include "daemon/frame_facts.h"
#include "daemon/log_event.h"
#include "daemon/messages.h"
#include "daemon/safety.h"
#include "daemon/service_manager.h"

namespace rig::daemon {

namespace {

constexpr std::size_t kRecentEvents = 20000;

// Groups of transactions of which the last counts (0 is none).
BusWorker::Group motion_of(std::size_t axis) {
  return static_cast<BusWorker::Group>(axis) + 1;
}
constexpr BusWorker::Group kShutter = static_cast<BusWorker::Group>(kAxisCount) + 1;
constexpr BusWorker::Group kLevel = kShutter + 1;

DeviceFailed failure(const std::string& device, const base::Error& error) {
  return {device + ": " + error.text(), device, error.code == base::ErrorCode::lost};
}

// The device says no, and is as it was.
bool is_unchanged(base::ErrorCode code) {
  return code == base::ErrorCode::refused || code == base::ErrorCode::busy ||
         code == base::ErrorCode::bad_input;
}

Deadline deadline(std::string what, double bound_s) {
  return {std::move(what), base::seconds(bound_s)};
}

template <typename... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <typename... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

}  // namespace

Loop::Loop(base::Clock& clock, Setup setup, State state, OpenDevices& devices, FramePool& pool)
    : clock_(clock),
      setup_(std::move(setup)),
      state_(std::move(state)),
      devices_(devices),
      pool_(pool),
      mailbox_(clock) {}

void Loop::post(What what) {
  mailbox_.push({clock_.now(), std::move(what), wall_->now()});
}

void Loop::attach(Storage& storage, protocol::Server& server, protocol::FrameDoor& frames) {
  frames_ = &frames;
  storage_ = &storage;
  server_ = &server;
}

void Loop::run() {
  state_.now = clock_.now();
  state_.look_at = state_.now;
  tell_service_manager();
  if (!state_.stopped.empty()) {
    // The rigd that latched the stop may have died before the devices were told.
    Actions again;
    drop_all(setup_, state_, again, state_.stopped);
    for (Action& action : again) carry_out(action);
  }
  while (!state_.ending) {
    const auto wake = next_wake(state_);
    auto event = mailbox_.pop(wake ? std::optional(wake->at) : std::nullopt,
                              wake ? wake->kind : base::WaitFor::person);
    if (!event) event = Event{clock_.now(), Tick{}, wall_->now()};
    // A call that is overdue comes first: what else happened may come from the device that hangs.
    for (const auto& [bus, worker] : devices_.workers) {
      while (const auto late = worker->overdue())
        take(Event{clock_.now(), DeviceFailed{*late}, wall_->now()});
    }
    take(*event);
  }
}

void Loop::take(const Event& event) {
  Step next = step(setup_, std::move(state_), event);
  state_ = std::move(next.state);
  // What rigd has to remember is on the disk before anybody is told.
  bool saves = false;
  for (Action& action : next.actions) {
    saves = saves || std::holds_alternative<SaveStop>(action) || std::holds_alternative<SaveJob>(action) ||
            std::holds_alternative<SaveLease>(action);
    if (saves && std::holds_alternative<SendReply>(action)) {
      storage_->queue(std::move(action));
    } else {
      carry_out(action);
    }
  }
  if (const auto* asked = std::get_if<Heartbeat>(&event.what)) asked->answer();
}

void Loop::to_axis(std::size_t axis, Turn turn, std::function<base::Result<void>(drivers::Axis&)> what) {
  auto transaction = [this, axis, what = std::move(what)] {
    if (auto done = what(*devices_.axes[axis]); !done) {
      post(failure(fmt::format("axis {}", machine::kAxisNames[axis]), done.error()));
    }
  };
  BusWorker& worker = *devices_.axis_workers[axis];
  const auto within = [&](const char* doing) {
    return deadline(fmt::format("axis {}: {}", machine::kAxisNames[axis], doing),
                    setup_.rig.deadlines.axis_s);
  };
  if (turn == Turn::stop) {
    worker.queue_first(std::move(transaction), motion_of(axis), within("a stop"));
  } else if (turn == Turn::command) {
    worker.queue(std::move(transaction), motion_of(axis), within("a command"));
  } else {
    worker.queue(std::move(transaction), 0, within("a reading"));
  }
}

// Here, on the camera's thread: the loop has to decide meanwhile.
std::shared_ptr<const std::vector<PreviewPicture>> Loop::previews_of(
    std::span<const std::uint16_t> pixels) const {
  const auto widths = server_->preview_widths();
  if (widths.empty()) return nullptr;
  auto previews = std::make_shared<std::vector<PreviewPicture>>();
  for (const int width : widths) previews->push_back({width, make_preview(setup_.rig.camera, pixels, width)});
  return previews;
}

void Loop::fetch(const FetchFrame& action) {
  devices_.camera_worker->queue(
      [this, action] {
        const auto slot = pool_.take();
        if (!slot) {
          post(FrameNotReady{action.exposure});  // the disk is behind: asked again shortly
          return;
        }
        auto frame = devices_.camera->fetch(pool_.pixels(*slot));
        if (!frame || !*frame) {
          pool_.release(*slot);
          if (frame) {
            post(FrameNotReady{action.exposure});
          } else if (frame.error().code == base::ErrorCode::damaged) {
            post(FrameDamaged{action.exposure, frame.error().text()});
          } else {
            post(failure("camera", frame.error()));
          }
          return;
        }
        hand_to_local_clients(*slot, **frame);
        const auto outline = machine::sample_outline(setup_.rig, action.angles_rad);
        const auto polygon = outline.value_or(std::vector<geometry::Vec2>{});
        const auto pixels = pool_.pixels(*slot);
        FrameFetched fetched{action.exposure, *slot, **frame,
                             saturated_share(setup_.rig.camera, pixels, polygon)};
        fetched.damage = damage_in(setup_.rig.camera, pixels);
        fetched.previews = previews_of(pixels);
        if (action.histogram) {
          fetched.histogram =
              std::make_shared<const SampleHistogram>(sample_histogram(setup_.rig.camera, pixels, polygon));
        }
        post(std::move(fetched));
      },
      0, deadline("camera: the transfer of a frame", setup_.rig.deadlines.frame_s));
}

void Loop::trigger(const TriggerCamera& action) {
  devices_.camera_worker->queue(
      [this, action] {
        const bool by_line = devices_.trigger.has_value();
        base::Result<void> ok;
        if (arm_first_) ok = devices_.camera->arm();
        if (ok) {
          arm_first_ = false;
          ok = by_line ? devices_.camera->await_trigger(action.exposure_s, 1)
                       : devices_.camera->trigger(action.exposure_s, 1);
        }
        if (!ok && ok.error().code == base::ErrorCode::busy) {
          post(CameraBusy{action.exposure, ok.error().text()});
        } else if (!ok) {
          post(failure("camera", ok.error()));
        } else if (by_line) {
          pulse(action.exposure);
        } else {
          post(CameraTriggered{action.exposure});
        }
      },
      0, deadline("camera: a trigger", setup_.rig.deadlines.camera_s));
}

// The exposure begins with the rising edge.
void Loop::pulse(std::uint64_t exposure) {
  const LinesDevice& lines = devices_.lines[*devices_.trigger];
  lines.worker->queue(
      [this, &lines, exposure] {
        const machine::TriggerLine& line = *setup_.rig.lines.camera_trigger;
        if (auto ok = lines.io->set(line.line.line, true); !ok) return post(failure(lines.name, ok.error()));
        post(CameraTriggered{exposure});
        base::WaitSlot slot;
        clock_.wait(slot, clock_.now() + base::seconds(line.pulse_s), base::WaitFor::rig);
        if (auto ok = lines.io->set(line.line.line, false); !ok) post(failure(lines.name, ok.error()));
      },
      0, deadline(lines.name + ": the camera's trigger", setup_.rig.deadlines.lines_s));
}

void Loop::read_lines(const LinesDevice& lines, base::Time asked) {
  lines.worker->queue(
      [this, &lines, asked] {
        const auto levels = lines.io->read();
        if (!levels) return post(failure(lines.name, levels.error()));
        if (levels->size() < lines.offered) {
          return post(DeviceFailed{fmt::format("{}: a reading of {} lines; {} were offered", lines.name,
                                               levels->size(), lines.offered),
                                   lines.name});
        }
        LinesRead read{lines.name, asked, {}, {}};
        if (lines.emergency_stop) read.emergency_stop = (*levels)[*lines.emergency_stop];
        for (std::size_t i = 0; i < kAxisCount; ++i) {
          for (std::size_t end = 0; end < kEnds; ++end) {
            if (lines.limits[i][end]) read.limits[i][end] = (*levels)[*lines.limits[i][end]];
          }
        }
        post(std::move(read));
      },
      0, deadline(lines.name + ": a reading", setup_.rig.deadlines.lines_s));
}

void Loop::hand_to_local_clients(FrameSlot slot, const drivers::FrameInfo& info) {
  const protocol::FrameBuffer& buffer = pool_.buffer(slot);
  protocol::LocalFrame frame;
  frame.set_generation(buffer.complete());
  // Of the machine's own time, whatever clock the rig goes by: a client compares it with its own.
  frame.set_complete_ns(static_cast<std::uint64_t>(
      std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count()));
  frame.set_slot(static_cast<std::uint32_t>(slot.index));
  frame.set_width(static_cast<std::uint32_t>(setup_.camera.width));
  frame.set_height(static_cast<std::uint32_t>(setup_.camera.height));
  frame.set_bits(static_cast<std::uint32_t>(setup_.camera.bits));
  frame.set_bayer(setup_.camera.bayer);
  frame.set_exposure_us(info.exposure_s * 1e6);
  frame.set_gain(info.gain);
  frame.set_counter(info.counter);
  frames_->publish(frame, buffer);
}

protocol::Frame Loop::describe(const drivers::FrameInfo& info, double share, const Preview& preview) const {
  protocol::Frame frame;
  frame.set_exposure_us(info.exposure_s * 1e6);
  frame.set_gain(info.gain);
  frame.set_counter(info.counter);
  frame.set_saturated_share(share);
  frame.set_preview_width(static_cast<std::uint32_t>(preview.width));
  frame.set_preview_height(static_cast<std::uint32_t>(preview.height));
  frame.set_preview_rgb(preview.rgb.data(), preview.rgb.size());
  frame.set_bits(static_cast<std::uint32_t>(setup_.camera.bits));
  frame.set_bayer(setup_.camera.bayer);
  frame.set_width(static_cast<std::uint32_t>(setup_.camera.width));
  frame.set_height(static_cast<std::uint32_t>(setup_.camera.height));
  return frame;
}

void Loop::publish(const protocol::Event& event) {
  recent_.push_back(event);
  if (recent_.size() > kRecentEvents) recent_.pop_front();
  server_->publish(event);
  counters_.count(event);
  tell_service_manager();
}

void Loop::tell_service_manager() {
  std::string status = status_line(state_);
  if (status == status_told_) return;
  notify_status(status);
  status_told_ = std::move(status);
}

protocol::Metrics Loop::metrics() const {
  return gather_metrics({state_, counters_, devices_, pool_, *storage_, *server_, mailbox_.size(), started_,
                         setup_.state_folder});
}

void Loop::reply_with_metrics(const Asker& asker) {
  protocol::Reply reply = make_reply(asker.id, protocol::DONE);
  *reply.mutable_metrics() = metrics();
  server_->reply(asker.client, reply);
}

void Loop::log_statistics() {
  const protocol::Metrics now = metrics();
  base::log_line(base::LogLevel::info, statistics_line(now, last_statistics_), statistics_fields(now));
  last_statistics_ = now;
  storage_->timings().forget_worst();
  for (const auto& [bus, worker] : devices_.workers) worker->timings().forget_worst();
}

void Loop::catch_up(const SubscribeClient& action) {
  protocol::Reply reply = make_reply(action.asker.id, protocol::DONE);
  auto& missed = *reply.mutable_catch_up();
  if (action.epoch != 0) {
    const auto key = [](const protocol::Event& e) { return std::pair(e.epoch(), e.number()); };
    for (const protocol::Event& event : recent_) {
      if (key(event) > std::pair(action.epoch, action.after)) *missed.add_missed() = event;
    }
    const bool reaches_back = recent_.empty()
                                  ? action.epoch == state_.epoch
                                  : key(recent_.front()) <= std::pair(action.epoch, action.after + 1);
    missed.set_truncated(!reaches_back);
  }
  server_->subscribe(action.asker.client, action.previews);
  server_->reply(action.asker.client, reply);
}

void Loop::carry_out(Action& action) {
  std::visit(
      Overloaded{
          [&](const EnableAxis& a) {
            to_axis(a.axis, Turn::command, [](drivers::Axis& x) { return x.enable(true); });
          },
          [&](const HomeAxis& a) {
            to_axis(a.axis, Turn::command, [](drivers::Axis& x) { return x.home(); });
          },
          [&](const MoveAxis& a) {
            to_axis(a.axis, Turn::command, [a](drivers::Axis& x) {
              return x.move_to(a.target_rad, a.velocity_rad_s, a.acceleration_rad_s2);
            });
          },
          [&](const JogAxis& a) {
            to_axis(a.axis, Turn::command, [this, a](drivers::Axis& x) -> base::Result<void> {
              auto moved = x.move_by(a.by_rad, a.velocity_rad_s, a.acceleration_rad_s2);
              if (moved || !is_unchanged(moved.error().code)) return moved;
              post(JogRefused{a.axis, moved.error().text()});
              return {};
            });
          },
          [&](const StopAxis& a) { to_axis(a.axis, Turn::stop, [](drivers::Axis& x) { return x.stop(); }); },
          [&](const PollAxis& a) {
            to_axis(a.axis, Turn::reading, [this, a](drivers::Axis& x) -> base::Result<void> {
              auto state = x.state();
              if (!state) return base::pass(state);
              post(AxisPolled{a.axis, a.number, *state});
              return {};
            });
          },
          [&](const ArmCamera&) {
            devices_.camera_worker->queue(
                [this] {
                  auto ok = devices_.camera->arm();
                  arm_first_ = !ok && ok.error().code == base::ErrorCode::busy;
                  if (!ok && !arm_first_) post(failure("camera", ok.error()));
                },
                0, deadline("camera: to get ready", setup_.rig.deadlines.camera_s));
          },
          [&](const TriggerCamera& a) { trigger(a); },
          [&](const FetchFrame& a) { fetch(a); },
          [&](const AbortCamera&) {
            devices_.camera_worker->queue(
                [this] {
                  if (auto ok = devices_.camera->abort(); !ok) post(failure("camera", ok.error()));
                },
                0, deadline("camera: to end an exposure", setup_.rig.deadlines.camera_s));
          },
          [&](const ProbeCamera&) {
            devices_.camera_worker->queue(
                [this] {
                  if (auto ok = devices_.camera->abort(); ok) {
                    post(CameraAnswered{});
                  } else {
                    post(failure("camera", ok.error()));
                  }
                },
                0, deadline("camera: to answer", setup_.rig.deadlines.camera_s));
          },
          [&](const ReadCameraTemperature&) {
            devices_.camera_worker->queue(
                [this] {
                  if (auto read = devices_.camera->temperature_c(); read) {
                    post(CameraTemperatureRead{*read});
                  } else {
                    post(failure("camera", read.error()));
                  }
                },
                0, deadline("camera: its temperature", setup_.rig.deadlines.camera_s));
          },
          [&](const SetLightLevel& a) {
            auto transaction = [this, a] {
              if (auto ok = devices_.light->set_level(a.level); !ok) post(failure("light", ok.error()));
            };
            const auto within = deadline("light: to set its level", setup_.rig.deadlines.light_s);
            if (a.level > 0) {
              devices_.light_worker->queue(transaction, kLevel, within);
            } else {
              devices_.light_worker->queue_first(transaction, kLevel, within);
            }
          },
          [&](const SetShutter& a) {
            auto transaction = [this, a] {
              if (auto ok = devices_.light->set_shutter(a.open); !ok) post(failure("light", ok.error()));
            };
            const auto within = deadline("light: its shutter", setup_.rig.deadlines.light_s);
            if (a.open) {
              devices_.light_worker->queue(transaction, kShutter, within);
            } else {
              devices_.light_worker->queue_first(transaction, kShutter, within);
            }
          },
          [&](const PollLight& a) {
            devices_.light_worker->queue(
                [this, a] {
                  if (auto state = devices_.light->state(); state) {
                    post(LightPolled{a.number, *state});
                  } else {
                    post(failure("light", state.error()));
                  }
                },
                0, deadline("light: a reading", setup_.rig.deadlines.light_s));
          },
          [&](const ReadLines& a) {
            for (const LinesDevice& lines : devices_.lines) {
              if (lines.has_limits || !a.limits_only) read_lines(lines, a.asked);
            }
          },
          [&](const ReleaseFrame& a) { pool_.release(a.slot); },
          [&](const SendReply& a) { server_->reply(a.client, a.reply); },
          [&](const ReplyWithFrame& a) {
            protocol::Reply reply = make_reply(a.asker.id, protocol::DONE);
            const auto pixels = pool_.pixels(a.slot);
            *reply.mutable_frame() =
                describe(a.info, a.saturated_share, make_preview(setup_.rig.camera, pixels, a.preview_width));
            if (a.full) reply.mutable_frame()->set_raw(pixels.data(), pixels.size_bytes());
            pool_.release(a.slot);
            server_->reply(a.asker.client, reply);
          },
          [&](const ReplyWithMetrics& a) { reply_with_metrics(a.asker); },
          [&](const LogStatistics&) { log_statistics(); },
          [&](const SubscribeClient& a) { catch_up(a); },
          [&](const UnsubscribeClient& a) { server_->unsubscribe(a.client); },
          [&](const Publish& a) {
            log_event(a.event);
            publish(a.event);
          },
          [&](const PublishPreview& a) {
            for (const PreviewPicture& made : *a.previews) {
              protocol::Event event;
              event.set_epoch(state_.epoch);
              auto& preview = *event.mutable_preview();
              preview.set_job(a.job);
              preview.set_row(a.row);
              preview.set_index(static_cast<std::uint32_t>(a.index));
              *preview.mutable_frame() = describe(a.info, a.saturated_share, made.picture);
              server_->publish_preview(std::move(event), made.wanted_width);
            }
          },
          [&](const auto& for_storage) { storage_->queue(for_storage); }},
      action);
}

}  // namespace rig::daemon
