#include "sim/machine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/random.h"
#include "sim/ride.h"

namespace rig::sim {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

Memory new_world(const World& world, std::int64_t now_ns) {
  Memory memory;
  memory.made = 1;
  memory.made_ns = now_ns;
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

// The same world, seen from a clock that is so much behind.
Memory earlier(Memory memory, std::int64_t by_ns) {
  memory.now_ns -= by_ns;
  memory.made_ns -= by_ns;
  memory.light_since_ns -= by_ns;
  for (AxisMemory& axis : memory.axes) axis.start_ns -= by_ns;
  return memory;
}

}  // namespace

Machine::Machine(const World& world, base::Clock& clock, std::filesystem::path folder, StateFile file,
                 Faults::Complain complain)
    : world_(world),
      clock_(clock),
      folder_(std::move(folder)),
      file_(std::move(file)),
      memory_(file_.load()),
      faults_(world.faults, folder_ / "faults.toml", std::move(complain)),
      button_(folder_, "emergency_stop") {
  clock_.not_before(base::Time(base::Duration(memory_.now_ns)));
  if (memory_.made == 0) memory_ = new_world(world_, now_ns());
  save();
}

Result<std::shared_ptr<Machine>> Machine::open(const World& world, base::Clock& clock,
                                               const std::filesystem::path& folder,
                                               Faults::Complain complain) {
  auto file = StateFile::open(folder / "world.state");
  if (!file) return base::pass(file);
  std::shared_ptr<Machine> machine(new Machine(world, clock, folder, std::move(*file), std::move(complain)));
  if (auto flushed = machine->file_.flush(); !flushed) return base::pass(flushed);
  if (!world.wire_log.empty()) {
    auto log = WireLog::open(folder / world.wire_log);
    if (!log) return base::pass(log);
    machine->wire_log_.emplace(std::move(*log));
  }
  return machine;
}

std::int64_t Machine::now_ns() const {
  return clock_.now().time_since_epoch().count();
}

double Machine::world_s() const {
  return 1e-9 * static_cast<double>(now_ns() - memory_.made_ns);
}

Result<void> Machine::reach(const std::string& device) {
  if (const auto late_s = strike(FaultKind::slow, device)) {
    base::WaitSlot nobody_calls;
    (void)clock_.wait(nobody_calls, clock_.now() + base::seconds(*late_s), base::WaitFor::rig);
  }
  if (strike(FaultKind::unplugged, device)) {
    return fail(ErrorCode::lost, "is not connected", device, "plug it in again");
  }
  if (strike(FaultKind::lost, device)) {
    return fail(ErrorCode::device, "does not answer any more; is it connected?", device);
  }
  return {};
}

std::optional<double> Machine::strike(FaultKind kind, const std::string& device) {
  return faults_.strike(kind, device, world_s());
}

void Machine::save() {
  memory_.now_ns = now_ns();
  file_.store(earlier(memory_, set_back_ns_));
}

bool Machine::button_pressed() const {
  return now_ns() < pressed_until_ns_ || button_.held();
}

void Machine::catch_up() {
  const std::int64_t now = now_ns();
  // A press that is over has cut the power, too.
  const bool made = button_.made();
  const bool cut = made || button_pressed();
  press_unread_ = press_unread_ || made;
  bool changed = false;
  for (std::size_t i = 0; i < kAxes; ++i) {
    AxisMemory& axis = memory_.axes[i];
    settle(axis, world_.axes[i], now);
    const bool stands = !axis_moving(axis, world_.axes[i], now) && !stalled_[i];
    if (axis.homing != 0 && stands) {
      axis.homing = 0;
      axis.homed = 1;
      axis.slip_rad = 0;
      axis.from_above = 0;  // homing ends with a slow approach from below
      changed = true;
    }
    if (cut && axis.enabled != 0) {
      cut_short(axis, world_.axes[i], now);
      stalled_[i] = false;
      axis.homing = 0;
      axis.enabled = 0;
      changed = true;
    }
  }
  if (changed) save();
}

void Machine::on_trigger_line(std::function<void()> listener) {
  const std::lock_guard lock(trigger_mutex_);
  on_trigger_ = std::move(listener);
}

void Machine::pulse_trigger_line() {
  const std::lock_guard lock(trigger_mutex_);
  if (on_trigger_) on_trigger_();
}

bool Machine::emergency_stop() {
  const std::lock_guard lock(mutex_);
  if (const auto step_s = strike(FaultKind::clock_step, "lines")) step_clock(*step_s);
  fill_disk();
  if (const auto held_s = strike(FaultKind::emergency_stop, "lines")) {
    pressed_until_ns_ = now_ns() + std::llround(1e9 * *held_s);
  }
  catch_up();
  return std::exchange(press_unread_, false) || button_pressed();
}

std::array<bool, 2> Machine::pressed_switches(std::size_t index) const {
  const AxisMemory& axis = memory_.axes[index];
  const AxisWorld& world = world_.axes[index];
  const double truly = axis_position(axis, world, now_ns()) + axis.slip_rad;
  const double half_count = 0.5 * world.resolution_rad;
  return {truly <= world.low_switch_rad + half_count, truly >= world.high_switch_rad - half_count};
}

void Machine::note_switches(std::size_t index) {
  const auto pressed = pressed_switches(index);
  for (std::size_t end = 0; end < pressed.size(); ++end)
    switches_unread_[index][end] = switches_unread_[index][end] || pressed[end];
}

std::array<std::array<bool, 2>, kAxes> Machine::limit_lines() {
  const std::lock_guard lock(mutex_);
  catch_up();
  for (std::size_t i = 0; i < kAxes; ++i) note_switches(i);
  auto pressed = std::exchange(switches_unread_, {});
  if (!faults_.has_any(FaultKind::limit_line)) return pressed;
  for (std::size_t i = 0; i < kAxes; ++i) {
    for (std::size_t end = 0; end < pressed[i].size(); ++end) {
      const bool stuck = faults_.strike_switch(FaultKind::limit_line, kAxisNames[i], end == 1, world_s());
      pressed[i][end] = pressed[i][end] || stuck;
    }
  }
  return pressed;
}

void Machine::step_clock(double by_s) {
  if (by_s >= 0) return clock_.not_before(clock_.now() + base::seconds(by_s));
  // The time of a process that runs only goes on; the next one begins with what the machine's clock says.
  set_back_ns_ += std::llround(-1e9 * by_s);
  save();
}

void Machine::fill_disk() {
  if (const auto full_s = strike(FaultKind::disk_full, "lines")) {
    disk_full_until_ns_ = now_ns() + std::llround(1e9 * *full_s);
    if (!disk_full_) disk_full_.emplace();
  }
  if (disk_full_ && now_ns() >= disk_full_until_ns_) disk_full_.reset();
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
  state.moving = axis_moving(axis, world, now) || stalled_[index];
  state.homed = axis.homed != 0;
  const auto stuck = [&](bool high) {
    return faults_.strike_switch(FaultKind::limit_switch, kAxisNames[index], high, world_s());
  };
  state.at_low_limit = counts <= counts_of(world, world.low_rad) || stuck(false);
  state.at_high_limit = counts >= counts_of(world, world.high_rad) || stuck(true);
  if (strike(FaultKind::garbage, kAxisNames[index])) {
    state.position_rad = std::numeric_limits<double>::quiet_NaN();
  }
  return state;
}

Result<void> Machine::enable(std::size_t index, bool on) {
  const std::lock_guard lock(mutex_);
  catch_up();
  AxisMemory& axis = memory_.axes[index];
  if (on && button_pressed()) {
    return fail(ErrorCode::device, "the emergency stop has cut the power of the drives", kAxisNames[index]);
  }
  stalled_[index] = false;
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
  note_switches(index);
  axis.homed = 0;
  axis.homing = 1;
  const double home = reached_target(index, world.home_rad);
  begin_move(axis, world, now_ns(), home, world.homing_velocity_rad_s, world.max_acceleration_rad_s2);
  save();
  return file_.flush();
}

Result<void> Machine::move(std::size_t index, double target_rad, double velocity, double acceleration) {
  const std::lock_guard lock(mutex_);
  catch_up();
  return set_off(index, target_rad, velocity, acceleration);
}

Result<void> Machine::jog(std::size_t index, double by_rad, double velocity, double acceleration) {
  const std::lock_guard lock(mutex_);
  catch_up();
  const AxisMemory& axis = memory_.axes[index];
  const AxisWorld& world = world_.axes[index];
  if (axis_moving(axis, world, now_ns()) || stalled_[index]) {
    return fail(ErrorCode::busy, "the axis moves", kAxisNames[index]);
  }
  const auto here = static_cast<double>(counts_of(world, axis_position(axis, world, now_ns())));
  return set_off(index, here * world.resolution_rad + by_rad, velocity, acceleration);
}

Result<void> Machine::set_off(std::size_t index, double target_rad, double velocity, double acceleration) {
  AxisMemory& axis = memory_.axes[index];
  const AxisWorld& world = world_.axes[index];
  if (axis.enabled == 0) return fail(ErrorCode::device, "the drive has no power", kAxisNames[index]);
  if (axis.homing != 0) return fail(ErrorCode::busy, "the axis is homing", kAxisNames[index]);
  const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
  if (!positive(velocity) || !positive(acceleration) || !std::isfinite(target_rad)) {
    return fail(ErrorCode::bad_input, "a move needs a target, a velocity and an acceleration",
                kAxisNames[index]);
  }
  note_switches(index);
  begin_move(axis, world, now_ns(), reached_target(index, target_rad), velocity, acceleration);
  if (const auto lost = strike(FaultKind::lost_steps, kAxisNames[index])) axis.slip_rad += *lost;
  save();
  return {};
}

Result<void> Machine::stop(std::size_t index) {
  const std::lock_guard lock(mutex_);
  catch_up();
  stalled_[index] = false;
  begin_brake(memory_.axes[index], world_.axes[index], now_ns());
  if (wire_log_) wire_log_->stopped(kAxisNames[index]);
  memory_.axes[index].homing = 0;
  save();
  return {};
}

drivers::LightState Machine::light_state() {
  const std::lock_guard lock(mutex_);
  if (memory_.light_level > 0 && strike(FaultKind::light_fails, "light")) {
    memory_.light_level = 0;
    lamp_failed_ = true;
    save();
  }
  drivers::LightState state;
  if (lamp_failed_) state.fault = "the lamp went out";
  lamp_failed_ = false;  // told once; whoever lights it again finds out whether it lasts
  state.on = memory_.light_level > 0;
  state.level = memory_.light_level;
  state.shutter_open = memory_.shutter_open != 0;
  const double lit_s = state.on ? 1e-9 * static_cast<double>(now_ns() - memory_.light_since_ns) : 0;
  state.warm = state.on && lit_s >= world_.light.warm_up_s;
  state.hours = memory_.lamp_hours + lit_s / 3600;
  if (strike(FaultKind::garbage, "light")) state.level = std::numeric_limits<double>::quiet_NaN();
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

double Machine::reached_target(std::size_t index, double target_rad) {
  stalled_[index] = false;
  const double here = axis_position(memory_.axes[index], world_.axes[index], now_ns());
  if (std::abs(target_rad - here) < world_.axes[index].resolution_rad) return target_rad;
  const auto share = strike(FaultKind::stall, kAxisNames[index]);
  stalled_[index] = share.has_value();
  if (!share) return target_rad;
  return here + *share * (target_rad - here);
}

double Machine::light_output(const Scene& scene) {
  const double lit_s = 1e-9 * static_cast<double>(now_ns() - memory_.light_since_ns);
  double light = memory_.light_level * warmth(world_.light, lit_s);
  if (const auto share = strike(FaultKind::light_drift, "light")) {
    std::uint64_t key = base::mix64(world_.seed);
    for (const std::int64_t counts : scene.counts)
      key = base::derive_key(key, static_cast<std::uint64_t>(counts));
    light *= 1 + *share * (2 * base::unit_from_bits(key) - 1);
  }
  if (const auto share = strike(FaultKind::light_excursion, "light")) light *= 1 + *share;
  return light;
}

Scene Machine::scene() {
  const std::lock_guard lock(mutex_);
  catch_up();
  const std::int64_t now = now_ns();
  Scene scene;
  for (std::size_t i = 0; i < kAxes; ++i) {
    scene.counts[i] = counts_of(world_.axes[i], axis_position(memory_.axes[i], world_.axes[i], now));
    scene.from_above[i] = memory_.axes[i].from_above != 0;
    scene.astray[i] = memory_.axes[i].slip_rad;
    const auto more = strike(FaultKind::backlash, kAxisNames[i]);
    if (more && scene.from_above[i]) scene.astray[i] += *more;
  }
  if (memory_.shutter_open != 0 && memory_.light_level > 0) scene.light = light_output(scene);
  // So that a virtual rig that dies now goes on from here.
  save();
  return scene;
}

}  // namespace rig::sim
