#include "drivers/cia402_axis/axis.h"

#include <algorithm>
#include <cmath>

namespace rig::drivers::cia402 {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using std::chrono::milliseconds;

namespace {

// What "target reached" and "homing attained" say so soon after a start may be said of the motion before.
constexpr base::Duration kMoveBegun = milliseconds(20), kHomingBegun = milliseconds(100);

// What leaves the module has no code that only the module understands.
template <typename T>
Result<T> at_the_door(Result<T> result) {
  if (!result && result.error().code == ErrorCode::not_found) result.error().code = ErrorCode::device;
  return result;
}

}  // namespace

Cia402Axis::Cia402Axis(std::shared_ptr<Network> network, const DriveSettings& settings, base::Clock& clock,
                       Network::Log log)
    : settings_(settings), clock_(clock), drive_(std::move(network), settings, std::move(log)) {}

AxisCapabilities Cia402Axis::capabilities() const {
  const AxisSettings& axis = settings_.axis;
  AxisCapabilities can{axis.scale.resolution_rad(), axis.max_velocity_rad_s, axis.max_acceleration_rad_s2,
                       settings_.reference == Reference::absolute, settings_.limit_switches};
  if (settings_.homing) {
    can.homing_velocity_rad_s = std::max(settings_.homing->speed_rad_s, settings_.homing->creep_rad_s);
  }
  return can;
}

Result<void> Cia402Axis::enable(bool on) {
  return at_the_door(on ? switch_on(deadline()) : switch_off(deadline()));
}

Result<void> Cia402Axis::home() {
  return at_the_door(start_homing(deadline()));
}

Result<void> Cia402Axis::move_to(double target_rad, double velocity_rad_s, double acceleration_rad_s2) {
  const AxisSettings& axis = settings_.axis;
  const auto target = axis.scale.counts(target_rad);
  if (!target) return pass(target);
  if (auto fine = check_rates(velocity_rad_s, acceleration_rad_s2); !fine) return fine;
  return at_the_door(start_move(*target, velocity_rad_s, acceleration_rad_s2, deadline()));
}

Result<void> Cia402Axis::move_by(double delta_rad, double velocity_rad_s, double acceleration_rad_s2) {
  if (const auto by = settings_.axis.scale.distance(delta_rad); !by) return pass(by);
  if (auto fine = check_rates(velocity_rad_s, acceleration_rad_s2); !fine) return fine;
  return at_the_door(start_jog(delta_rad, velocity_rad_s, acceleration_rad_s2, deadline()));
}

Result<void> Cia402Axis::check_rates(double velocity, double acceleration) const {
  if (velocity > 0 && acceleration > 0 && !std::isinf(velocity + acceleration)) return {};
  return fail(ErrorCode::bad_input, "a move needs a finite velocity and acceleration above 0",
              drive_.where());
}

Result<void> Cia402Axis::stop() {
  const auto sent = drive_.quick_stop(deadline());
  standstill_.commanded(clock_.now());
  if (doing_ == Doing::homing) break_off_homing();
  doing_ = Doing::nothing;
  return at_the_door(sent);
}

Result<AxisState> Cia402Axis::state() {
  return at_the_door(look_at_it(deadline()));
}

Result<void> Cia402Axis::reach(Deadline deadline) {
  if (auto reached = drive_.reach(deadline); !reached) return reached;
  if (drive_.acquaintance() == acquaintance_) return {};
  acquaintance_ = drive_.acquaintance();
  doing_ = Doing::nothing;
  homed_ = settings_.reference == Reference::homing_mode ? Homed::unknown : Homed::no;
  ask_when_on_ = false;
  homing_failed_ = false;
  standstill_ = {};
  return {};
}

Result<Cia402Axis::Look> Cia402Axis::reach_and_look(Deadline deadline) {
  while (true) {
    if (auto reached = reach(deadline); !reached) return pass(reached);
    auto seen = look(deadline);
    // A boot-up message comes before every answer of the drive that booted.
    if (!seen || drive_.is_the_same()) return seen;
  }
}

Result<Cia402Axis::Look> Cia402Axis::look(Deadline deadline) {
  Look look;
  const auto statusword = drive_.statusword(deadline);
  if (!statusword) return pass(statusword);
  look.statusword = *statusword;
  look.power = power_of(*statusword);
  const auto position = drive_.read<std::int32_t>(object::kPosition, deadline);
  if (!position) return pass(position);
  look.position = *position;
  standstill_.saw(look.position, clock_.now());
  if (settings_.limit_switches) {
    auto inputs = drive_.read<std::uint32_t>(object::kDigitalInputs, deadline);
    if (!inputs) {
      if (inputs.error().code == ErrorCode::not_found) {
        inputs.error().hint = "set limit_switches = false for a drive that does not tell of them";
      }
      return pass(inputs);
    }
    const std::uint32_t active = settings_.limits_active_low ? ~*inputs : *inputs;
    look.at_low = (active & 1U) != 0;
    look.at_high = (active & 2U) != 0;
    if (settings_.axis.scale.reversed) std::swap(look.at_low, look.at_high);
  }
  if (look.power == Power::fault || look.power == Power::fault_reaction) {
    const auto code = drive_.read<std::uint16_t>(object::kErrorCode, deadline);
    if (code) {
      look.error_code = *code;
    } else if (code.error().code == ErrorCode::lost) {
      return pass(code);
    } else if (drive_.monitor().emergency()) {
      look.error_code = drive_.monitor().emergency()->code;
    }
  }
  return look;
}

Result<AxisState> Cia402Axis::look_at_it(Deadline deadline) {
  const auto seen = reach_and_look(deadline);
  if (!seen) return pass(seen);
  if (doing_ == Doing::homing) {
    if (auto followed = follow_homing(*seen, deadline); !followed) return pass(followed);
  }
  if (doing_ == Doing::moving && seen->power != Power::operation_enabled) doing_ = Doing::nothing;
  if (loses_reference(seen->error_code)) homed_ = Homed::no;
  if (homed_ == Homed::unknown) {
    if (auto asked = ask_whether_homed(*seen, deadline); !asked) return pass(asked);
  }
  AxisState state;
  state.position_rad = settings_.axis.scale.radians(seen->position);
  state.enabled = is_energised(seen->power);
  state.moving = is_moving(*seen);
  state.homed = is_homed(*seen);
  state.at_low_limit = seen->at_low;
  state.at_high_limit = seen->at_high;
  state.fault = fault_of(*seen);
  return state;
}

bool Cia402Axis::is_moving(const Look& look) const {
  const base::Time now = clock_.now();
  switch (look.power) {
    case Power::operation_enabled:
      if (doing_ == Doing::homing) return true;
      if (doing_ == Doing::moving && now - began_ < kMoveBegun) return true;
      if (look.has(status::kTargetReached)) return false;
      // A set-point that a limit keeps it from is never reached, and not every drive calls the position at
      // which it was switched on reached.
      if (doing_ == Doing::nothing || look.at_low || look.at_high || look.has(status::kInternalLimit)) {
        return !standstill_.is_sure(now);
      }
      return true;
    case Power::quick_stop:
      // CiA 402 says "target reached" once it stands; not every drive does.
      return !look.has(status::kTargetReached) && !standstill_.is_sure(now);
    case Power::fault_reaction:
      return true;
    case Power::not_ready:
    case Power::switch_on_disabled:
    case Power::ready:
    case Power::switched_on:
    case Power::fault:
      return standstill_.changed();
  }
  return false;
}

bool Cia402Axis::is_homed(const Look& look) const {
  switch (settings_.reference) {
    case Reference::absolute:
      return !loses_reference(look.error_code);
    case Reference::statusword_bit:
      return doing_ != Doing::homing && look.has(static_cast<std::uint16_t>(1U << settings_.referenced_bit));
    case Reference::homing_mode:
    case Reference::session:
      return homed_ == Homed::yes;
  }
  return false;
}

std::string Cia402Axis::fault_of(const Look& look) {
  NodeMonitor& monitor = drive_.monitor();
  std::string text;
  if (look.power == Power::fault || look.power == Power::fault_reaction) {
    const auto& told = monitor.emergency();
    text = "drive fault: " +
           (told && told->code == look.error_code
                ? text_of(*told)
                : fmt::format("{} (0x{:04X})", text_of_error_code(look.error_code), look.error_code));
  } else if (monitor.emergency()) {
    text = "emergency of the drive: " + text_of(*monitor.emergency());
  } else if (homing_failed_) {
    text = "homing failed: the drive did not find its reference";
  } else if (look.power == Power::operation_enabled && drive_.mode() == kProfilePosition &&
             look.has(status::kFollowingError)) {
    text = "following error: the motor does not keep up with its set-point";
  }
  monitor.told();
  return text;
}

void Cia402Axis::break_off_homing() {
  doing_ = Doing::nothing;
  homed_ = Homed::no;
}

Result<void> Cia402Axis::follow_homing(const Look& look, Deadline deadline) {
  if (look.power != Power::operation_enabled) {
    break_off_homing();
    return {};
  }
  if (clock_.now() - began_ < kHomingBegun) return {};
  if (look.has(status::kHomingError)) {
    break_off_homing();
    homing_failed_ = true;
  } else if (look.has(status::kHomingAttained) && look.has(status::kTargetReached)) {
    doing_ = Doing::nothing;
    homed_ = Homed::yes;
  } else {
    return {};
  }
  // The start bit back: a later homing begins with its edge.
  return drive_.control(control::kEnableOperation, deadline);
}

// In homing mode the drive shows whether it was homed, whichever rigd or tool homed it. Asked once it stands,
// and never in a fault.
Result<void> Cia402Axis::ask_whether_homed(const Look& look, Deadline deadline) {
  const bool is_on = look.power == Power::operation_enabled || look.power == Power::quick_stop;
  if (look.power == Power::not_ready || look.power == Power::fault || look.power == Power::fault_reaction)
    return {};
  if (is_on && is_moving(look)) return {};
  const std::int8_t before = drive_.mode();
  if (look.power == Power::operation_enabled) {
    // Not the edge, but still: no drive is to find the bit set that starts a homing. Halt stays as it was.
    const auto controlword = drive_.read<std::uint16_t>(object::kControlword, deadline);
    if (!controlword) return pass(controlword);
    if ((*controlword & control::kStartHoming) != 0) {
      const auto without = static_cast<std::uint16_t>(*controlword & ~control::kStartHoming);
      if (auto done = drive_.control(without, deadline); !done) return done;
    }
  }
  homed_ = Homed::no;
  const auto shows = drive_.set_mode(kHoming, deadline);
  if (!shows) return pass(shows);
  if (*shows) {
    const auto statusword = drive_.statusword(deadline);
    if (!statusword) return pass(statusword);
    const bool attained = (*statusword & status::kHomingAttained) != 0;
    const bool failed = (*statusword & status::kHomingError) != 0;
    if (attained && !failed) homed_ = Homed::yes;
  } else {
    ask_when_on_ = !is_on;
  }
  if (before == kHoming || before == 0) return {};
  const auto back = drive_.set_mode(before, deadline);
  if (!back) return pass(back);
  return {};
}

Result<void> Cia402Axis::switch_on(Deadline deadline) {
  if (auto reached = reach(deadline); !reached) return reached;
  const auto statusword = drive_.statusword(deadline);
  if (!statusword) return pass(statusword);
  if (power_of(*statusword) == Power::fault) {
    if (auto reset = reset_fault(drive_, deadline); !reset) return reset;
  }
  drive_.monitor().acknowledge();
  homing_failed_ = false;
  if (power_of(*statusword) != Power::operation_enabled) doing_ = Doing::nothing;
  if (auto on = reach_operation(drive_, deadline); !on) return on;
  if (std::exchange(ask_when_on_, false)) homed_ = Homed::unknown;
  return {};
}

Result<void> Cia402Axis::switch_off(Deadline deadline) {
  if (auto reached = reach(deadline); !reached) return reached;
  if (doing_ == Doing::homing) break_off_homing();
  doing_ = Doing::nothing;
  return let_motor_go(drive_, deadline);
}

Result<std::uint32_t> Cia402Axis::velocity_units(double rad_s) const {
  CountScale scale = settings_.axis.scale;
  scale.counts_per_rad *= settings_.velocity_unit;
  const auto rate = scale.rate(rad_s);
  if (!rate) return pass(rate);
  return static_cast<std::uint32_t>(*rate);
}

Result<std::uint32_t> Cia402Axis::acceleration_units(double rad_s2) const {
  CountScale scale = settings_.axis.scale;
  scale.counts_per_rad *= settings_.acceleration_unit;
  const auto rate = scale.rate(rad_s2);
  if (!rate) return pass(rate);
  return static_cast<std::uint32_t>(*rate);
}

Result<Cia402Axis::Look> Cia402Axis::look_before_move(Deadline deadline) {
  auto seen = reach_and_look(deadline);
  if (!seen) return seen;
  if (doing_ == Doing::homing) {
    if (auto followed = follow_homing(*seen, deadline); !followed) return pass(followed);
  }
  if (doing_ == Doing::homing) {
    return fail(ErrorCode::busy, "the axis is being homed", drive_.where(), "wait for it, or stop it");
  }
  return seen;
}

Result<void> Cia402Axis::start_move(std::int32_t target, double velocity, double acceleration,
                                    Deadline deadline) {
  const auto seen = look_before_move(deadline);
  if (!seen) return pass(seen);
  if (homed_ == Homed::unknown) {
    if (auto asked = ask_whether_homed(*seen, deadline); !asked) return asked;
  }
  if (!is_homed(*seen)) {
    return fail(ErrorCode::refused, "the axis is not homed: the drive does not know where it stands",
                drive_.where(), "home it first");
  }
  return set_off(target, velocity, acceleration, deadline);
}

// As a set-point in the drive's own counting, not as a relative one (bit 6): those count from the set-point
// before, also from one that a stop kept the axis from, unless the drive has object 60F2.
Result<void> Cia402Axis::start_jog(double delta_rad, double velocity, double acceleration,
                                   Deadline deadline) {
  const auto seen = look_before_move(deadline);
  if (!seen) return pass(seen);
  if (is_energised(seen->power) && is_moving(*seen)) {
    return fail(ErrorCode::busy, "the axis moves", drive_.where(), "wait for its end, or stop it");
  }
  if ((seen->at_low && delta_rad < 0) || (seen->at_high && delta_rad > 0)) {
    return fail(ErrorCode::refused, "the axis stands on its limit switch and would be driven further in",
                drive_.where(), "drive it out; if it is out, mend the switch");
  }
  const auto target = settings_.axis.scale.away_from(seen->position, delta_rad);
  if (!target) return pass(target);
  return set_off(*target, velocity, acceleration, deadline);
}

Result<void> Cia402Axis::set_off(std::int32_t target, double velocity, double acceleration,
                                 Deadline deadline) {
  const AxisSettings& axis = settings_.axis;
  const auto speed = velocity_units(std::min(velocity, axis.max_velocity_rad_s));
  if (!speed) return pass(speed);
  const auto change = acceleration_units(std::min(acceleration, axis.max_acceleration_rad_s2));
  if (!change) return pass(change);
  if (auto on = require_operation(drive_, deadline); !on) return on;
  if (auto mode = require_mode(drive_, kProfilePosition, deadline); !mode) return mode;
  if (auto done = drive_.write(object::kTargetPosition, target, deadline); !done) return done;
  if (auto done = drive_.write(object::kProfileVelocity, *speed, deadline); !done) return done;
  if (auto done = drive_.write(object::kAcceleration, *change, deadline); !done) return done;
  if (auto done = drive_.write(object::kDeceleration, *change, deadline); !done) return done;
  if (auto done = hand_over_set_point(drive_, deadline); !done) return done;
  doing_ = Doing::moving;
  began_ = clock_.now();
  standstill_.commanded(began_);
  return {};
}

Result<void> Cia402Axis::start_homing(Deadline deadline) {
  if (!settings_.homing) {
    return fail(ErrorCode::refused, "the axis has an absolute encoder and no homing method", drive_.where(),
                "set homing_method if it is to be homed all the same");
  }
  const auto seen = reach_and_look(deadline);
  if (!seen) return pass(seen);
  if (doing_ == Doing::homing || (seen->power == Power::operation_enabled && is_moving(*seen))) {
    return fail(ErrorCode::busy, doing_ == Doing::homing ? "the axis is being homed" : "the axis is moving",
                drive_.where(), "wait for it, or stop it");
  }
  if (auto on = require_operation(drive_, deadline); !on) return on;
  const HomingSettings& homing = *settings_.homing;
  const auto speed = velocity_units(homing.speed_rad_s), creep = velocity_units(homing.creep_rad_s);
  const auto change = acceleration_units(homing.acceleration_rad_s2);
  for (const auto* rate : {&speed, &creep, &change}) {
    if (!*rate) return pass(*rate);
  }
  if (auto done = drive_.control(control::kEnableOperation, deadline); !done) return done;
  if (auto mode = require_mode(drive_, kHoming, deadline); !mode) return mode;
  if (auto done = drive_.write(object::kHomingMethod, homing.method, deadline); !done) return done;
  if (auto done = drive_.write(object::kHomingSpeed, *speed, deadline); !done) return done;
  if (auto done = drive_.write(object::kHomingCreep, *creep, deadline); !done) return done;
  if (auto done = drive_.write(object::kHomingAcceleration, *change, deadline); !done) return done;
  // Count 0 is where the reference is found: zero_deg says which angle that is. Drives do not agree on the
  // sign of their own offset.
  if (auto done = drive_.write(object::kHomeOffset, std::int32_t{0}, deadline);
      !done && done.error().code != ErrorCode::not_found) {
    return done;
  }
  homed_ = Homed::no;
  homing_failed_ = false;
  if (auto done = drive_.control(control::kEnableOperation | control::kStartHoming, deadline); !done)
    return done;
  doing_ = Doing::homing;
  began_ = clock_.now();
  standstill_.commanded(began_);
  return {};
}

}  // namespace rig::drivers::cia402
