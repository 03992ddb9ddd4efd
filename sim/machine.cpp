#include "sim/machine.h"

#include <algorithm>
#include <cmath>

#include "sim/ride.h"

namespace rig::sim {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

Memory new_world(const World& world, std::int64_t now_ns) {
  Memory memory;
  memory.made = 1;
  for (std::size_t i = 0; i < kAxes; ++i) {
    memory.axes[i].to = counts_of(world.axes[i], world.axes[i].power_on_rad);
    memory.axes[i].from_rad = static_cast<double>(memory.axes[i].to) * world.axes[i].resolution_rad;
  }
  if (world.light.warm_at_start) {
    memory.light_level = 1;
    memory.light_since_ns = now_ns - std::llround(1e9 * world.light.warm_up_s);
  }
  return memory;
}

}  // namespace

Machine::Machine(const World& world, base::Clock& clock, std::filesystem::path folder, StateFile file)
    : world_(world),
      clock_(clock),
      folder_(std::move(folder)),
      file_(std::move(file)),
      memory_(file_.load()) {
  clock_.not_before(base::Time(base::Duration(memory_.now_ns)));
  if (memory_.made == 0) memory_ = new_world(world_, now_ns());
  save();
}

Result<std::shared_ptr<Machine>> Machine::open(const World& world, base::Clock& clock,
                                               const std::filesystem::path& folder) {
  auto file = StateFile::open(folder / "world.state");
  if (!file) return base::pass(file);
  std::shared_ptr<Machine> machine(new Machine(world, clock, folder, std::move(*file)));
  if (auto flushed = machine->file_.flush(); !flushed) return base::pass(flushed);
  return machine;
}

std::int64_t Machine::now_ns() const {
  return clock_.now().time_since_epoch().count();
}

void Machine::save() {
  memory_.now_ns = now_ns();
  file_.store(memory_);
}

bool Machine::button_pressed() const {
  std::error_code unreadable_is_released;
  return std::filesystem::exists(folder_ / "emergency_stop", unreadable_is_released);
}

void Machine::catch_up() {
  const std::int64_t now = now_ns();
  const bool cut = button_pressed();
  bool changed = false;
  for (std::size_t i = 0; i < kAxes; ++i) {
    AxisMemory& axis = memory_.axes[i];
    settle(axis, world_.axes[i], now);
    const bool stands = !axis_moving(axis, world_.axes[i], now);
    if (axis.homing != 0 && stands) {
      axis.homing = 0;
      axis.homed = 1;
      axis.from_above = 0;  // homing ends with a slow approach from below
      changed = true;
    }
    if (cut && axis.enabled != 0) {
      cut_short(axis, world_.axes[i], now);
      axis.homing = 0;
      axis.enabled = 0;
      changed = true;
    }
  }
  if (changed) save();
}

bool Machine::emergency_stop() {
  const std::lock_guard lock(mutex_);
  catch_up();
  return button_pressed();
}

drivers::AxisState Machine::axis_state(std::size_t index) {
  const std::lock_guard lock(mutex_);
  catch_up();
  const AxisMemory& axis = memory_.axes[index];
  const AxisWorld& world = world_.axes[index];
  const std::int64_t now = now_ns();
  const std::int64_t counts = counts_of(world, axis_position(axis, world, now));
  drivers::AxisState state;
  state.position_rad = static_cast<double>(counts) * world.resolution_rad;
  state.enabled = axis.enabled != 0;
  state.moving = axis_moving(axis, world, now);
  state.homed = axis.homed != 0;
  state.at_low_limit = counts <= counts_of(world, world.low_rad);
  state.at_high_limit = counts >= counts_of(world, world.high_rad);
  return state;
}

Result<void> Machine::enable(std::size_t index, bool on) {
  const std::lock_guard lock(mutex_);
  catch_up();
  AxisMemory& axis = memory_.axes[index];
  if (on && button_pressed()) {
    return fail(ErrorCode::device, "the emergency stop has cut the power of the drives", kAxisNames[index]);
  }
  if (!on) {
    cut_short(axis, world_.axes[index], now_ns());
    axis.homing = 0;
  }
  axis.enabled = on ? 1 : 0;
  save();
  return file_.flush();
}

Result<void> Machine::home(std::size_t index) {
  const std::lock_guard lock(mutex_);
  catch_up();
  AxisMemory& axis = memory_.axes[index];
  const AxisWorld& world = world_.axes[index];
  if (axis.enabled == 0) return fail(ErrorCode::device, "the drive has no power", kAxisNames[index]);
  axis.homed = 0;
  axis.homing = 1;
  begin_move(axis, world, now_ns(), world.home_rad, world.homing_velocity_rad_s,
             world.max_acceleration_rad_s2);
  save();
  return file_.flush();
}

Result<void> Machine::move(std::size_t index, double target_rad, double velocity, double acceleration) {
  const std::lock_guard lock(mutex_);
  catch_up();
  AxisMemory& axis = memory_.axes[index];
  const AxisWorld& world = world_.axes[index];
  if (axis.enabled == 0) return fail(ErrorCode::device, "the drive has no power", kAxisNames[index]);
  if (axis.homing != 0) return fail(ErrorCode::busy, "the axis is homing", kAxisNames[index]);
  if (!(velocity > 0) || !(acceleration > 0) || !std::isfinite(target_rad)) {
    return fail(ErrorCode::bad_input, "a move needs a target, a velocity and an acceleration",
                kAxisNames[index]);
  }
  begin_move(axis, world, now_ns(), target_rad, velocity, acceleration);
  save();
  return {};
}

Result<void> Machine::stop(std::size_t index) {
  const std::lock_guard lock(mutex_);
  catch_up();
  begin_brake(memory_.axes[index], world_.axes[index], now_ns());
  memory_.axes[index].homing = 0;
  save();
  return {};
}

drivers::LightState Machine::light_state() {
  const std::lock_guard lock(mutex_);
  drivers::LightState state;
  state.on = memory_.light_level > 0;
  state.level = memory_.light_level;
  state.shutter_open = memory_.shutter_open != 0;
  const double lit_s = state.on ? 1e-9 * static_cast<double>(now_ns() - memory_.light_since_ns) : 0;
  state.warm = state.on && lit_s >= world_.light.warm_up_s;
  state.hours = memory_.lamp_hours + lit_s / 3600;
  return state;
}

Result<void> Machine::set_level(double level) {
  if (!(level >= 0 && level <= 1)) return fail(ErrorCode::bad_input, "a level is from 0 to 1", "light");
  const std::lock_guard lock(mutex_);
  const std::int64_t now = now_ns();
  if (memory_.light_level > 0 && level <= 0) {
    memory_.lamp_hours += 1e-9 * static_cast<double>(now - memory_.light_since_ns) / 3600;
  }
  if (memory_.light_level <= 0 && level > 0) memory_.light_since_ns = now;
  memory_.light_level = level;
  save();
  return file_.flush();
}

void Machine::set_shutter(bool open) {
  const std::lock_guard lock(mutex_);
  memory_.shutter_open = open ? 1 : 0;
  save();
}

Scene Machine::scene() {
  const std::lock_guard lock(mutex_);
  catch_up();
  const std::int64_t now = now_ns();
  Scene scene;
  for (std::size_t i = 0; i < kAxes; ++i) {
    scene.counts[i] = counts_of(world_.axes[i], axis_position(memory_.axes[i], world_.axes[i], now));
    scene.from_above[i] = memory_.axes[i].from_above != 0;
  }
  if (memory_.shutter_open != 0 && memory_.light_level > 0) {
    const double lit_s = 1e-9 * static_cast<double>(now - memory_.light_since_ns);
    scene.light = memory_.light_level * warmth(world_.light, lit_s);
  }
  // So that a virtual rig that dies now goes on from here.
  save();
  return scene;
}

}  // namespace rig::sim
