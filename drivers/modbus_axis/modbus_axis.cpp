#include "drivers/modbus_axis/modbus_axis.h"

#include <algorithm>
#include <cmath>

namespace rig::drivers::modbus {

using base::ErrorCode;
using base::fail;
using base::pass;

namespace {

constexpr base::Duration kLookEvery = std::chrono::milliseconds(5);

Peer peer_of(const DriveSettings& settings, const ReadPlan& plan) {
  return {settings.slave, settings.profile->line.one_word_single, plan.blocks};
}

Result<void> check_rates(const AxisSettings& axis, double velocity_rad_s, double acceleration_rad_s2) {
  if (velocity_rad_s > 0 && acceleration_rad_s2 > 0 && std::isfinite(velocity_rad_s + acceleration_rad_s2))
    return {};
  return fail(ErrorCode::bad_input, "velocity and acceleration must be numbers greater than 0", axis.name);
}

}  // namespace

ModbusAxis::ModbusAxis(DriveSettings settings, std::shared_ptr<Bus> bus, base::Clock& clock)
    : settings_(std::move(settings)),
      profile_(*settings_.profile),
      plan_(plan_reads(profile_, settings_.options)),
      bus_(std::move(bus)),
      clock_(clock),
      peer_(peer_of(settings_, plan_)),
      watch_(profile_.motion) {}

AxisCapabilities ModbusAxis::capabilities() const {
  return {settings_.axis.scale.resolution_rad(), settings_.axis.max_velocity_rad_s,
          settings_.axis.max_acceleration_rad_s2, profile_.keeps_position_unpowered,
          is_told(profile_.low_limit, settings_.options) && is_told(profile_.high_limit, settings_.options)};
}

Result<Reading> ModbusAxis::read_now() {
  std::vector<std::vector<std::uint16_t>> words;
  for (const Block& block : plan_.blocks) {
    auto read = bus_->read(peer_, block);
    if (!read) return pass(read);
    words.push_back(std::move(*read));
  }
  if (known_opened_ != bus_->times_opened() || known_lost_ != peer_.times_lost) {
    known_opened_ = bus_->times_opened();
    known_lost_ = peer_.times_lost;
    watch_.forget();
    compared_ = is_set_up_ = false;
  }
  if (!compared_) {
    if (auto same = compare_expected(); !same) return pass(same);
    compared_ = true;
  }
  return decode_reading(profile_, settings_.options, plan_, words);
}

Result<void> ModbusAxis::compare_expected() {
  const auto expected = fill_in_all(profile_.expect, {});
  if (!expected) return pass(expected);
  for (const Write& words : *expected) {
    const auto read =
        bus_->read(peer_, {Table::holding, words.address, static_cast<std::uint16_t>(words.words.size())});
    if (!read) return pass(read);
    const auto [is, should] = std::mismatch(read->begin(), read->end(), words.words.begin());
    if (is == read->end()) continue;
    return fail(ErrorCode::device,
                fmt::format("its register 0x{:04X} holds {}, the settings say {}",
                            words.address + (is - read->begin()), *is, *should),
                settings_.axis.name, "set the drive, or the axis' drive settings in rig.toml");
  }
  return {};
}

Result<std::string> ModbusAxis::read_alarm() {
  if (!profile_.alarm) return alarm_text(profile_, std::nullopt);
  const Register& reg = profile_.registers[*profile_.alarm];
  const Block block{reg.table, reg.at(settings_.options), static_cast<std::uint16_t>(reg.words())};
  const auto words = bus_->read(peer_, block);
  if (!words) return pass(words);
  return alarm_text(profile_, decode(*words, reg.format));
}

Result<Reading> ModbusAxis::ready_to_move() {
  auto reading = read_now();
  if (!reading) return reading;
  if (reading->fault) {
    const auto alarm = read_alarm();
    if (!alarm) return pass(alarm);
    return fail(ErrorCode::device, *alarm, settings_.axis.name);
  }
  if (!reading->enabled) {
    return fail(ErrorCode::refused, "the drive is not enabled", settings_.axis.name);
  }
  // A motion that is over is noticed also where nobody has asked for the state since.
  const bool moving = watch_.moving(clock_.now(), *reading);
  if (moving && !profile_.replaces_moves) {
    return fail(ErrorCode::busy, "this drive takes no command while it moves", settings_.axis.name);
  }
  return reading;
}

bool ModbusAxis::is_homed(const Reading& reading) const {
  if (watch_.homing()) return false;
  const Flag& homed = profile_.homed;
  const bool remembered = homed.kind == Flag::Kind::remembered ||
                          (homed.kind == Flag::Kind::test && !is_told(homed, settings_.options));
  return remembered ? watch_.homed_here() : reading.homed;
}

bool ModbusAxis::stands_at(bool high, const Reading& reading) const {
  return high != settings_.axis.scale.reversed ? reading.high_limit : reading.low_limit;
}

Quantities ModbusAxis::fixed_quantities() const {
  Quantities quantities;
  const double counts_per_rad = settings_.axis.scale.counts_per_rad;
  quantities[Quantity::max_velocity] = settings_.axis.max_velocity_rad_s * counts_per_rad;
  quantities[Quantity::max_acceleration] = settings_.axis.max_acceleration_rad_s2 * counts_per_rad;
  return quantities;
}

Result<std::vector<Write>> ModbusAxis::fill_in_all(const std::vector<Step>& steps,
                                                   const Quantities& quantities) const {
  std::vector<Write> writes;
  for (const Step& step : steps) {
    auto write = fill_in(step, profile_.options, settings_.options, profile_.values, quantities);
    if (!write) {
      return fail(write.error().code, write.error().what, settings_.axis.name);
    }
    writes.push_back(std::move(*write));
  }
  return writes;
}

Result<void> ModbusAxis::run(const std::vector<Step>& steps, const Quantities& quantities) {
  const auto writes = fill_in_all(steps, quantities);
  if (!writes) return pass(writes);
  for (const Write& write : *writes) {
    if (auto written = bus_->write(peer_, write); !written) return written;
  }
  return {};
}

Result<void> ModbusAxis::set_up() {
  Quantities quantities = fixed_quantities();
  if (auto done = run(profile_.setup, quantities); !done) return done;
  if (settings_.soft_limits) {
    const auto low = settings_.axis.scale.counts(settings_.soft_limits->low_rad);
    const auto high = settings_.axis.scale.counts(settings_.soft_limits->high_rad);
    if (!low) return pass(low);
    if (!high) return pass(high);
    quantities[Quantity::soft_low] = std::min(*low, *high);
    quantities[Quantity::soft_high] = std::max(*low, *high);
    if (auto done = run(profile_.soft_limits, quantities); !done) return done;
  }
  is_set_up_ = true;
  return {};
}

Result<void> ModbusAxis::enable(bool on) {
  bus_->begin_call();
  const auto reading = read_now();
  if (!reading) return pass(reading);
  if (!on) {
    if (profile_.disable.empty()) {
      return fail(ErrorCode::refused, "the drive's description has no way to let it go", settings_.axis.name);
    }
    return run(profile_.disable, fixed_quantities());
  }
  if (reading->fault) {
    if (auto done = run(profile_.clear_alarm, fixed_quantities()); !done) return done;
  }
  if (auto done = set_up(); !done) return done;
  if (auto done = run(profile_.enable, fixed_quantities()); !done) return done;
  // A command often follows at once: the drive is given its moment here. Where it does not come to that,
  // state() says so.
  const base::Duration moment = std::chrono::milliseconds(profile_.motion.enable_ms);
  const base::Time until = clock_.now() + std::min(moment, bus_->time_to_spare());
  while (true) {
    const auto now = read_now();
    if (!now) return pass(now);
    if ((now->enabled && !now->fault) || clock_.now() >= until) return {};
    (void)clock_.wait(slot_, clock_.now() + kLookEvery, base::WaitFor::rig);
  }
}

Result<void> ModbusAxis::home() {
  bus_->begin_call();
  if (profile_.home.empty()) {
    return fail(ErrorCode::refused, "the drive's description has no homing", settings_.axis.name);
  }
  const auto before = ready_to_move();
  if (!before) return pass(before);
  // Each time, for the drive may have lost it in a power cut that nobody noticed.
  if (auto done = set_up(); !done) return done;
  watch_.home(clock_.now(), *before);
  if (auto done = run(profile_.home, fixed_quantities()); !done) return done;
  watch_.home(clock_.now(), *before);
  return {};
}

Result<void> ModbusAxis::move_to(double target_rad, double velocity_rad_s, double acceleration_rad_s2) {
  bus_->begin_call();
  const AxisSettings& axis = settings_.axis;
  const auto target = axis.scale.counts(target_rad);
  if (!target) return pass(target);
  if (auto fine = check_rates(axis, velocity_rad_s, acceleration_rad_s2); !fine) return fine;
  const auto before = ready_to_move();
  if (!before) return pass(before);
  if (!is_homed(*before)) {
    return fail(ErrorCode::refused, "the drive does not know where it stands", axis.name, "home it first");
  }
  return go(*before, Way::to_target, *target, velocity_rad_s, acceleration_rad_s2);
}

// As a target in the drive's own counting where it takes one: repeated after an answer that was lost, it is
// the same move.
Result<void> ModbusAxis::move_by(double delta_rad, double velocity_rad_s, double acceleration_rad_s2) {
  bus_->begin_call();
  const AxisSettings& axis = settings_.axis;
  if (const auto by = axis.scale.distance(delta_rad); !by) return pass(by);
  if (auto fine = check_rates(axis, velocity_rad_s, acceleration_rad_s2); !fine) return fine;
  const auto before = ready_to_move();
  if (!before) return pass(before);
  if (watch_.moving(clock_.now(), *before)) {
    return fail(ErrorCode::busy, "the axis moves", axis.name, "wait for its end, or stop it");
  }
  const auto target = axis.scale.away_from(before->position_counts, delta_rad);
  if (!target) return pass(target);
  return go(*before, profile_.jog.empty() ? Way::to_target : Way::by_distance, *target, velocity_rad_s,
            acceleration_rad_s2);
}

Result<void> ModbusAxis::go(const Reading& before, Way way, double target_counts, double velocity_rad_s,
                            double acceleration_rad_s2) {
  const AxisSettings& axis = settings_.axis;
  const bool upwards = (target_counts > before.position_counts) != axis.scale.reversed;
  if (target_counts != before.position_counts && stands_at(upwards, before)) {
    return fail(ErrorCode::refused,
                fmt::format("it stands at its {} limit switch", upwards ? "upper" : "lower"), axis.name,
                "move it the other way");
  }
  if (!is_set_up_) {
    if (auto done = set_up(); !done) return done;
  }
  Quantities quantities = fixed_quantities();
  quantities[Quantity::position] =
      way == Way::to_target ? target_counts : target_counts - before.position_counts;
  quantities[Quantity::velocity] =
      std::min(velocity_rad_s, axis.max_velocity_rad_s) * axis.scale.counts_per_rad;
  quantities[Quantity::acceleration] =
      std::min(acceleration_rad_s2, axis.max_acceleration_rad_s2) * axis.scale.counts_per_rad;
  watch_.move(clock_.now(), before, target_counts);
  if (way == Way::to_target) {
    if (auto done = run(profile_.move, quantities); !done) return done;
  } else {
    const auto writes = fill_in_all(profile_.jog, quantities);
    if (!writes) return pass(writes);
    for (const Write& write : *writes) {
      if (auto written = bus_->write_once(peer_, write); !written) return written;
    }
  }
  watch_.move(clock_.now(), before, target_counts);
  return {};
}

Result<void> ModbusAxis::stop() {
  bus_->begin_call();
  const auto writes = fill_in_all(profile_.stop, fixed_quantities());
  if (!writes) return pass(writes);
  watch_.stop(clock_.now());
  // Every step is tried, whatever became of the one before.
  Result<void> outcome;
  for (const Write& write : *writes) {
    auto written = bus_->write_at_once(peer_, write);
    if (!written && outcome) outcome = written;
  }
  watch_.stop(clock_.now());
  return outcome;
}

Result<AxisState> ModbusAxis::state() {
  bus_->begin_call();
  const auto reading = read_now();
  if (!reading) return pass(reading);
  AxisState state;
  state.position_rad = settings_.axis.scale.radians(reading->position_counts);
  state.enabled = reading->enabled;
  state.moving = watch_.moving(clock_.now(), *reading);
  state.homed = is_homed(*reading);
  state.at_low_limit = stands_at(false, *reading);
  state.at_high_limit = stands_at(true, *reading);
  state.temperature_c = reading->temperature_c;
  if (reading->fault) {
    auto alarm = read_alarm();
    if (!alarm) return pass(alarm);
    state.fault = std::move(*alarm);
  }
  return state;
}

void check_settings(const base::ConfigTable& settings) {
  (void)read_settings(settings);
}

Result<std::vector<Device>> open_devices(const OpenContext& context) {
  ModuleSettings settings = read_settings(context.settings);
  if (auto fine = context.settings.noted(); !fine) return pass(fine);
  const auto bus = std::make_shared<Bus>(settings.wire, settings.retry, context.clock);
  std::vector<Device> devices;
  for (DriveSettings& drive : settings.drives) {
    const std::string name = drive.axis.name;
    devices.push_back(
        {name, settings.wire.where(), std::make_unique<ModbusAxis>(std::move(drive), bus, context.clock)});
  }
  return devices;
}

}  // namespace rig::drivers::modbus
