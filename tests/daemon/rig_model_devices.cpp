// Drives, camera, light and lines.
#include <cmath>
#include <limits>

#include "core/machine/motion.h"
#include "tests/daemon/rig_model.h"

namespace rig::daemon::testing {

using base::seconds;

namespace {

constexpr std::size_t kSlots = 3;

}  // namespace

double RigModel::place(std::size_t axis) const {
  const Drive& d = drives_[axis];
  if (now_ >= d.end || d.end <= d.start) return d.to;
  if (d.acceleration > 0) {
    const double t = base::to_seconds(now_ - d.start);
    return d.from + machine::travel_share(d.to - d.from, d.velocity, d.acceleration, t) * (d.to - d.from);
  }
  const double share = base::to_seconds(now_ - d.start) / base::to_seconds(d.end - d.start);
  return d.from + share * (d.to - d.from);
}

bool RigModel::moving(std::size_t axis) const {
  return drives_[axis].stuck || now_ < drives_[axis].end;
}

void RigModel::read_lines(base::Time asked) {
  if (lines_silent || lost("lines") || chance(faults.lost)) return;
  if (chance(faults.refused)) return answer(DeviceFailed{"lines: no answer", "lines"});
  LinesRead read{"lines", asked, emergency_stop, {}};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (setup_.rig.lines.limit[i][kLow]) read.limits[i][kLow] = place(i) <= line_switch_rad[i][kLow];
    if (setup_.rig.lines.limit[i][kHigh]) read.limits[i][kHigh] = place(i) >= line_switch_rad[i][kHigh];
  }
  answer(std::move(read));
}

void RigModel::drive(std::size_t axis, double to, double duration_s) {
  Drive& d = drives_[axis];
  d.from = place(axis);
  d.to = to;
  d.start = now_;
  d.end = now_ + seconds(duration_s);
  d.velocity = d.acceleration = 0;
  d.stuck = chance(faults.stuck);
}

void RigModel::stop_drive(std::size_t axis) {
  Drive& d = drives_[axis];
  ++stops_[axis];
  if (d.homing) d.homing = false;
  if (!moving(axis)) return;
  d.from = d.to = place(axis);
  d.start = now_;
  d.end = now_ + seconds(0.2);  // it brakes
  d.velocity = d.acceleration = 0;
  d.stuck = false;
}

void RigModel::poll(std::size_t axis, std::uint64_t number) {
  Drive& d = drives_[axis];
  if (d.homing && !moving(axis)) {
    d.homing = false;
    d.homed = true;
  }
  drivers::AxisState reading{
      place(axis),          d.enabled,          moving(axis), d.homed, on_low_switch[axis],
      on_high_switch[axis], latched_fault[axis]};
  if (chance(faults.garbage)) {
    switch (random_.below(4)) {
      case 0:
        reading.position_rad = std::numeric_limits<double>::quiet_NaN();
        break;
      case 1:
        reading.position_rad += 0.5;
        break;
      case 2:
        reading.homed = false;
        break;
      default:
        reading.fault = "overheated";
        break;
    }
  }
  answer(AxisPolled{axis, number, reading});
}

void RigModel::fetch(std::uint64_t exposure) {
  if (lost("camera")) return;
  if (chance(faults.lost)) return;
  if (chance(faults.refused)) return answer(DeviceFailed{"the camera refuses"});
  if (!exposing_) return answer(DeviceFailed{"no exposure was triggered"});
  const bool ready = now_ >= exposing_->first + seconds(exposing_->second + setup_.camera.readout_s);
  if (!ready || slots_.size() >= kSlots || chance(faults.garbage)) return answer(FrameNotReady{exposure});
  if (state_.frame && state_.frame->exposure == exposure && state_.frame->row >= 0) {
    const base::Time over = exposing_->first + seconds(exposing_->second);
    for (const Drive& drive : drives_) {
      const bool went = drive.end > drive.start && drive.end > exposing_->first && drive.start < over;
      expect(!went, "an axis moved while the camera exposed");
    }
  }
  if (chance(faults.damaged)) {
    exposing_.reset();
    return answer(FrameDamaged{exposure, "part of it never came"});
  }
  const FrameSlot slot{next_slot_++};
  slots_.insert(slot.index);
  auto histogram = std::make_shared<SampleHistogram>();
  if (chance(0.9)) {
    auto& green = histogram->counts[1];
    green.resize(4096);
    for (int i = 0; i < 100; ++i) ++green[chance(0.1) ? 4095 : random_.below(4096)];
  }
  answer(FrameFetched{exposure,
                      slot,
                      {exposing_->second, 1, exposing_->first, ++frames_},
                      random_.uniform(),
                      histogram,
                      chance(0.5) ? std::make_shared<const std::vector<PreviewPicture>>(1) : nullptr,
                      chance(faults.damaged) ? "lines of zeros" : ""});
  exposing_.reset();
}

// Whether it was for a device.
bool RigModel::to_device(const Action& action) {
  if (const auto* enable = std::get_if<EnableAxis>(&action)) {
    on_channel(
        kAxes,
        [this, i = enable->axis] {
          drives_[i].enabled = true;
          latched_fault[i].clear();
        },
        static_cast<int>(enable->axis));
  } else if (const auto* home = std::get_if<HomeAxis>(&action)) {
    on_channel(
        kAxes,
        [this, i = home->axis] {
          expect(!latched_, "an axis homes after a stop");
          drives_[i].homed = false;
          drives_[i].homing = true;
          drive(i, setup_.rig.axes[i].home_rad, random_.uniform(0.1, 3));
        },
        static_cast<int>(home->axis));
  } else if (const auto* move = std::get_if<MoveAxis>(&action)) {
    on_channel(
        kAxes,
        [this, m = *move] {
          expect(!latched_, "an axis moves after a stop");
          const double off = chance(faults.off_target) ? 0.02 : 0;
          drive(
              m.axis, m.target_rad + off,
              machine::travel_time_s(m.target_rad - place(m.axis), m.velocity_rad_s, m.acceleration_rad_s2));
          drives_[m.axis].velocity = m.velocity_rad_s;
          drives_[m.axis].acceleration = m.acceleration_rad_s2;
        },
        static_cast<int>(move->axis));
  } else if (const auto* jog = std::get_if<JogAxis>(&action)) {
    on_channel(
        kAxes,
        [this, j = *jog] {
          expect(!latched_, "an axis moves after a stop");
          if (refuses_jogs) return answer(JogRefused{j.axis, "this drive cannot"});
          drive(j.axis, place(j.axis) + j.by_rad,
                machine::travel_time_s(j.by_rad, j.velocity_rad_s, j.acceleration_rad_s2));
          drives_[j.axis].velocity = j.velocity_rad_s;
          drives_[j.axis].acceleration = j.acceleration_rad_s2;
        },
        static_cast<int>(jog->axis));
  } else if (const auto* stop = std::get_if<StopAxis>(&action)) {
    stop_drive(stop->axis);
  } else if (const auto* asked = std::get_if<PollAxis>(&action)) {
    on_channel(kAxes, [this, p = *asked] {
      if (chance(faults.lost) || lost(fmt::format("axis {}", machine::kAxisNames[p.axis]))) return;
      if (chance(faults.refused)) return answer(DeviceFailed{"an axis does not talk"});
      poll(p.axis, p.number);
    });
  } else if (std::holds_alternative<ArmCamera>(action)) {
    on_channel(kCamera, [this] { exposing_.reset(); });
  } else if (const auto* trigger = std::get_if<TriggerCamera>(&action)) {
    check_trigger();
    on_channel(kCamera, [this, t = *trigger] {
      if (now_ < busy_until || chance(faults.busy)) return answer(CameraBusy{t.exposure, "it exposes"});
      exposing_ = {now_, t.exposure_s};
      answer(CameraTriggered{t.exposure});
    });
  } else if (const auto* wanted = std::get_if<FetchFrame>(&action)) {
    on_channel(kCamera, [this, exposure = wanted->exposure] { fetch(exposure); });
  } else if (std::holds_alternative<ProbeCamera>(action)) {
    on_channel(kCamera, [this] {
      if (!lost("camera")) answer(CameraAnswered{});
    });
  } else if (std::holds_alternative<ReadCameraTemperature>(action)) {
    on_channel(kCamera, [this] {
      if (!lost("camera")) answer(CameraTemperatureRead{camera_temperature_c});
    });
  } else if (std::holds_alternative<AbortCamera>(action)) {
    on_channel(kCamera, [this] { exposing_.reset(); });
  } else if (const auto* level = std::get_if<SetLightLevel>(&action)) {
    on_channel(kLight, [this, l = level->level] {
      if (level_ <= 0 && l > 0) lit_ = now_;
      level_ = l;
    });
  } else if (const auto* shutter = std::get_if<SetShutter>(&action)) {
    on_channel(kLight, [this, open = shutter->open] { shutter_ = open; });
  } else if (const auto* look = std::get_if<PollLight>(&action)) {
    on_channel(kLight, [this, number = look->number] {
      if (chance(faults.lost)) return;
      const bool warm = level_ > 0 && now_ >= lit_ + seconds(setup_.light.warm_up_s);
      drivers::LightState light{level_ > 0, shutter_, level_, warm, 0, chance(faults.garbage) ? "lamp" : ""};
      if (on_light_read) on_light_read(light);
      answer(LightPolled{number, light});
    });
  } else if (const auto* lines = std::get_if<ReadLines>(&action)) {
    on_channel(kLight, [this, asked = lines->asked] { read_lines(asked); });
  } else {
    return false;
  }
  return true;
}

}  // namespace rig::daemon::testing
