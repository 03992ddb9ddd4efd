#include "sim/machine.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/base/random.h"
#include "core/base/units.h"
#include "sim/exposure.h"

namespace rig::sim {

using base::Duration;
using base::ErrorCode;
using base::fail;
using base::Result;
using base::Time;

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr double kLampWarmUpShare = 0.9;  // a cold lamp gives this much of its level

// Time of a move from rest to rest, and where it is after some of it: ramp, cruise, ramp.
struct Ride {
  double distance, velocity, acceleration, ramp_s, total_s;

  Ride(double d, double v, double a)
      : distance(std::abs(d)), velocity(v), acceleration(a), ramp_s(0), total_s(0) {
    if (distance <= 0 || v <= 0 || a <= 0) return;
    velocity = std::min(v, std::sqrt(distance * a));
    ramp_s = velocity / a;
    total_s = ramp_s + distance / velocity;
  }
  [[nodiscard]] double done(double t) const {
    if (t >= total_s || distance <= 0) return distance;
    if (t <= 0) return 0;
    if (t < ramp_s) return 0.5 * acceleration * t * t;
    if (t < total_s - ramp_s) return velocity * (t - 0.5 * ramp_s);
    return distance - 0.5 * acceleration * (total_s - t) * (total_s - t);
  }
  [[nodiscard]] double speed(double t) const {
    return std::clamp(std::min({acceleration * t, velocity, acceleration * (total_s - t)}), 0.0, velocity);
  }
};

Ride ride_of(const AxisMemory& axis, const AxisWorld& world) {
  return {static_cast<double>(axis.to - axis.from) * world.resolution_rad, axis.velocity_rad_s,
          axis.acceleration_rad_s2};
}

}  // namespace

Machine::Machine(const World& world, base::Clock& clock, std::filesystem::path folder, StateFile file)
    : world_(world),
      clock_(clock),
      folder_(std::move(folder)),
      file_(std::move(file)),
      memory_(file_.load()),
      renderer_(world_) {
  if (memory_.made == 0) {
    memory_.made = 1;
    for (std::size_t i = 0; i < kAxes; ++i) {
      memory_.axes[i].to = memory_.axes[i].from = counts_of(world_.axes[i], world_.axes[i].power_on_rad);
    }
  }
  clock_.not_before(Time(Duration(memory_.now_ns)));
}

Result<std::shared_ptr<Machine>> Machine::open(const World& world, base::Clock& clock,
                                               const std::filesystem::path& folder) {
  auto file = StateFile::open(folder / "world.state");
  if (!file) return base::pass(file);
  return std::shared_ptr<Machine>(new Machine(world, clock, folder, std::move(*file)));
}

void Machine::save() {
  memory_.now_ns = clock_.now().time_since_epoch().count();
  file_.store(memory_);
}

double Machine::position(const AxisMemory& axis, std::size_t index) const {
  const double elapsed =
      static_cast<double>(clock_.now().time_since_epoch().count() - axis.start_ns) / kSecond;
  const double sign = axis.to >= axis.from ? 1 : -1;
  return static_cast<double>(axis.from) * world_.axes[index].resolution_rad +
         sign * ride_of(axis, world_.axes[index]).done(elapsed);
}

bool Machine::moving(const AxisMemory& axis, std::size_t index) const {
  const double elapsed =
      static_cast<double>(clock_.now().time_since_epoch().count() - axis.start_ns) / kSecond;
  return axis.to != axis.from && elapsed < ride_of(axis, world_.axes[index]).total_s;
}

void Machine::finish_homing() {
  for (std::size_t i = 0; i < kAxes; ++i) {
    AxisMemory& axis = memory_.axes[i];
    if (axis.homing != 0 && !moving(axis, i)) {
      axis.homing = 0;
      axis.homed = 1;
      axis.from_above = 0;  // homing ends with a slow approach from below
      save();
    }
  }
}

// Ends a move where it can: at once without power, else after braking from its present speed.
void Machine::halt(AxisMemory& axis, std::size_t index, bool braking) {
  if (!moving(axis, index)) return;
  const AxisWorld& world = world_.axes[index];
  const double elapsed =
      static_cast<double>(clock_.now().time_since_epoch().count() - axis.start_ns) / kSecond;
  const Ride ride = ride_of(axis, world);
  const double sign = axis.to >= axis.from ? 1 : -1;
  const double here = position(axis, index);
  const double speed = ride.speed(elapsed);
  const double rest = braking ? 0.5 * speed * speed / axis.acceleration_rad_s2 : 0;
  axis.to = counts_of(world, here + sign * rest);
  axis.from = counts_of(world, here);
  axis.start_ns = clock_.now().time_since_epoch().count();
  axis.homing = 0;
}

void Machine::cut_power_if_stopped() {
  std::error_code unreadable_is_absent;
  if (!std::filesystem::exists(folder_ / "emergency_stop", unreadable_is_absent)) return;
  bool changed = false;
  for (std::size_t i = 0; i < kAxes; ++i) {
    AxisMemory& axis = memory_.axes[i];
    if (axis.enabled == 0) continue;
    halt(axis, i, false);
    axis.enabled = 0;
    changed = true;
  }
  if (changed) save();
}

bool Machine::emergency_stop() {
  const std::lock_guard lock(mutex_);
  cut_power_if_stopped();
  std::error_code unreadable_is_absent;
  return std::filesystem::exists(folder_ / "emergency_stop", unreadable_is_absent);
}

drivers::AxisState Machine::axis_state(std::size_t index) {
  const std::lock_guard lock(mutex_);
  cut_power_if_stopped();
  finish_homing();
  const AxisMemory& axis = memory_.axes[index];
  const AxisWorld& world = world_.axes[index];
  drivers::AxisState state;
  state.position_rad = static_cast<double>(counts_of(world, position(axis, index))) * world.resolution_rad;
  state.enabled = axis.enabled != 0;
  state.moving = moving(axis, index);
  state.homed = axis.homed != 0;
  state.at_low_limit = state.position_rad <= world.low_rad;
  state.at_high_limit = state.position_rad >= world.high_rad;
  return state;
}

Result<void> Machine::enable(std::size_t index, bool on) {
  const std::lock_guard lock(mutex_);
  cut_power_if_stopped();
  std::error_code unreadable_is_absent;
  if (on && std::filesystem::exists(folder_ / "emergency_stop", unreadable_is_absent)) {
    return fail(ErrorCode::device, "the emergency stop cut the power of the drives", kAxisNames[index]);
  }
  if (!on) halt(memory_.axes[index], index, false);
  memory_.axes[index].enabled = on ? 1 : 0;
  save();
  return {};
}

void Machine::start_move(std::size_t index, double target_rad, double velocity, double acceleration) {
  const AxisWorld& world = world_.axes[index];
  AxisMemory& axis = memory_.axes[index];
  const std::int64_t here = counts_of(world, position(axis, index));
  const std::int64_t target = counts_of(world, std::clamp(target_rad, world.low_rad, world.high_rad));
  axis.from = here;
  axis.to = target;
  axis.start_ns = clock_.now().time_since_epoch().count();
  axis.velocity_rad_s = std::min(velocity, world.max_velocity_rad_s);
  axis.acceleration_rad_s2 = std::min(acceleration, world.max_acceleration_rad_s2);
  if (target != here) axis.from_above = target < here ? 1 : 0;
}

Result<void> Machine::home(std::size_t index) {
  const std::lock_guard lock(mutex_);
  cut_power_if_stopped();
  AxisMemory& axis = memory_.axes[index];
  if (axis.enabled == 0) return fail(ErrorCode::device, "the drive has no power", kAxisNames[index]);
  const AxisWorld& world = world_.axes[index];
  axis.homed = 0;
  axis.homing = 1;
  start_move(index, world.home_rad, world.homing_velocity_rad_s, world.max_acceleration_rad_s2);
  save();
  return {};
}

Result<void> Machine::move(std::size_t index, double target_rad, double velocity, double acceleration) {
  const std::lock_guard lock(mutex_);
  cut_power_if_stopped();
  finish_homing();
  AxisMemory& axis = memory_.axes[index];
  if (axis.enabled == 0) return fail(ErrorCode::device, "the drive has no power", kAxisNames[index]);
  if (axis.homing != 0) return fail(ErrorCode::busy, "the axis is homing", kAxisNames[index]);
  if (moving(axis, index)) return fail(ErrorCode::busy, "the axis is moving", kAxisNames[index]);
  if (!(velocity > 0) || !(acceleration > 0) || !std::isfinite(target_rad)) {
    return fail(ErrorCode::bad_input, "a move needs a target, a velocity and an acceleration",
                kAxisNames[index]);
  }
  start_move(index, target_rad, velocity, acceleration);
  save();
  return {};
}

Result<void> Machine::stop(std::size_t index) {
  const std::lock_guard lock(mutex_);
  halt(memory_.axes[index], index, true);
  save();
  return {};
}

drivers::LightState Machine::light_state() {
  const std::lock_guard lock(mutex_);
  const std::int64_t now = clock_.now().time_since_epoch().count();
  drivers::LightState state;
  state.on = memory_.light_level > 0;
  state.level = memory_.light_level;
  state.shutter_open = memory_.shutter_open != 0;
  const double lit_s = state.on ? static_cast<double>(now - memory_.light_since_ns) / kSecond : 0;
  state.warm = state.on && lit_s >= world_.light.warm_up_s;
  state.hours = memory_.lamp_hours + lit_s / 3600;
  return state;
}

void Machine::set_level(double level) {
  const std::lock_guard lock(mutex_);
  const std::int64_t now = clock_.now().time_since_epoch().count();
  if (memory_.light_level > 0 && level <= 0) {
    memory_.lamp_hours += static_cast<double>(now - memory_.light_since_ns) / kSecond / 3600;
  }
  if (memory_.light_level <= 0 && level > 0) memory_.light_since_ns = now;
  memory_.light_level = std::clamp(level, 0.0, 1.0);
  save();
}

void Machine::set_shutter(bool open) {
  const std::lock_guard lock(mutex_);
  memory_.shutter_open = open ? 1 : 0;
  save();
}

double Machine::light_now() const {
  if (memory_.shutter_open == 0) return 0;
  const double lit_s =
      static_cast<double>(clock_.now().time_since_epoch().count() - memory_.light_since_ns) / kSecond;
  return memory_.light_level * (lit_s >= world_.light.warm_up_s ? 1 : kLampWarmUpShare);
}

void Machine::arm() {
  const std::lock_guard lock(mutex_);
  exposure_.reset();
  taken_.clear();
}

Result<void> Machine::trigger(double exposure_s, double gain) {
  const std::lock_guard lock(mutex_);
  if (exposure_)
    return fail(ErrorCode::busy, "the camera is exposing or its frame was not fetched", "camera");
  if (!(exposure_s >= world_.camera.min_exposure_s && exposure_s <= world_.camera.max_exposure_s)) {
    return fail(ErrorCode::bad_input, fmt::format("the camera cannot expose for {} us", exposure_s * 1e6),
                "camera");
  }
  Exposure e{clock_.now(), exposure_s, gain, taken_[{exposure_s, gain}]++, {}, {}, light_now()};
  for (std::size_t i = 0; i < kAxes; ++i) {
    e.counts[i] = counts_of(world_.axes[i], position(memory_.axes[i], i));
    e.from_above[i] = memory_.axes[i].from_above != 0;
  }
  exposure_ = e;
  ++counter_;
  save();
  return {};
}

Result<std::optional<drivers::FrameInfo>> Machine::fetch(std::span<std::uint16_t> pixels) {
  const std::lock_guard lock(mutex_);
  const CameraWorld& camera = world_.camera;
  if (!exposure_) return fail(ErrorCode::device, "no exposure was triggered", "camera");
  if (pixels.size() != static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)) {
    return fail(ErrorCode::bad_input, "the buffer has not the size of a frame", "camera");
  }
  const Exposure& e = *exposure_;
  if (clock_.now() < e.started + base::seconds(e.exposure_s + camera.readout_s)) {
    return std::optional<drivers::FrameInfo>();
  }
  Angles angles{};
  std::uint64_t key = base::mix64(world_.seed);
  std::string rendered_key = fmt::format("{}", e.level);
  for (std::size_t i = 0; i < kAxes; ++i) {
    angles[i] = true_angle(world_, i, e.counts[i], e.from_above[i]);
    key = base::derive_key(key, static_cast<std::uint64_t>(e.counts[i]));
    rendered_key += fmt::format(" {}{}", e.counts[i], e.from_above[i] ? "v" : "^");
  }
  if (rendered_key != rendered_key_) {
    rendered_ = renderer_.render(angles, e.level);
    rendered_key_ = rendered_key;
  }
  key = base::derive_key(key, std::bit_cast<std::uint64_t>(e.exposure_s));
  key = base::derive_key(base::derive_key(key, std::bit_cast<std::uint64_t>(e.gain)), e.nth);
  expose(camera, rendered_, e.exposure_s, e.gain, key, pixels);
  const drivers::FrameInfo info{e.exposure_s, e.gain, e.started, counter_};
  exposure_.reset();
  return std::optional<drivers::FrameInfo>(info);
}

void Machine::abort() {
  const std::lock_guard lock(mutex_);
  exposure_.reset();
}

}  // namespace rig::sim
