#include "sim/wire/cia402_drive.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rig::sim::wire {

using std::chrono::milliseconds;

namespace {

constexpr std::uint16_t kRemote = 1U << 9U, kReached = 1U << 10U, kLimited = 1U << 11U;
constexpr std::uint16_t kBit12 = 1U << 12U, kBit13 = 1U << 13U;
constexpr std::uint16_t kNewSetPoint = 1U << 4U, kAtOnce = 1U << 5U, kRelative = 1U << 6U;
constexpr std::uint16_t kFaultReset = 1U << 7U, kHalt = 1U << 8U;
constexpr std::int8_t kProfilePosition = 1, kHomingMode = 6;
// Friction brakes a motor without current.
constexpr double kCoasting = 200000;
constexpr double kStrongest = 1e7;
constexpr std::uint16_t kCommunication = 0x8100;
constexpr milliseconds kCycle{1};

// What a controlword orders (CiA 402): its bits 0 to 3 and 7.
bool orders_disable_voltage(std::uint16_t c) {
  return (c & 0x82U) == 0x00U;
}
bool orders_quick_stop(std::uint16_t c) {
  return (c & 0x86U) == 0x02U;
}
bool orders_shutdown(std::uint16_t c) {
  return (c & 0x87U) == 0x06U;
}
bool orders_switch_on(std::uint16_t c) {
  return (c & 0x8FU) == 0x07U;
}
bool orders_operation(std::uint16_t c) {
  return (c & 0x8FU) == 0x0FU;
}

}  // namespace

Cia402Drive::Cia402Drive(const Settings& settings, CanopenDictionary& dictionary)
    : settings_(settings),
      objects_(dictionary),
      motor_(settings.start, {settings.low_stop, settings.high_stop}) {
  add_objects();
}

void Cia402Drive::add_objects() {
  using Access = CanopenDictionary::Access;
  const auto ro = [&](std::uint16_t index, std::size_t bytes, std::function<std::uint32_t()> get) {
    objects_.add(index, 0, {.bytes = bytes, .access = Access::ro, .get = std::move(get)});
  };
  const auto rw = [&](std::uint16_t index, std::uint8_t sub, std::size_t bytes, std::int64_t value,
                      std::function<std::uint32_t(std::uint32_t)> set = {}) {
    objects_.add(index, sub,
                 {.bytes = bytes,
                  .access = Access::rw,
                  .value = static_cast<std::uint32_t>(value),
                  .set = std::move(set)});
  };
  const auto not_zero = [](std::uint32_t value) { return value == 0 ? abort_code::kOutOfRange : 0U; };
  ro(0x603F, 2, [this] { return error_; });
  rw(0x6040, 0, 2, 0, [this](std::uint32_t value) {
    control(static_cast<std::uint16_t>(value));
    return 0U;
  });
  ro(0x6041, 2, [this] { return statusword(); });
  rw(0x605A, 0, 2, 2, [](std::uint32_t value) {
    const auto option = static_cast<std::int16_t>(value);
    const bool known = (option >= 0 && option <= 3) || (option >= 5 && option <= 7);
    return known ? 0U : abort_code::kOutOfRange;
  });
  rw(0x6060, 0, 1, 0, [](std::uint32_t value) {
    const auto mode = static_cast<std::int8_t>(value);
    return mode == kProfilePosition || mode == kHomingMode ? 0U : abort_code::kOutOfRange;
  });
  ro(0x6061, 1, [this] { return static_cast<std::uint32_t>(mode_); });
  ro(0x6064, 4, [this] { return static_cast<std::uint32_t>(reported()); });
  rw(0x607A, 0, 4, 0);
  rw(0x607C, 0, 4, 0);
  rw(0x6081, 0, 4, 1000);
  rw(0x6083, 0, 4, 10000, not_zero);
  rw(0x6084, 0, 4, 10000, not_zero);
  rw(0x6085, 0, 4, 50000, not_zero);
  rw(0x6098, 0, 1, 35, [](std::uint32_t value) {
    const auto method = static_cast<std::int8_t>(value);
    const bool known = method == 17 || method == 18 || method == 35 || method == 37;
    return known ? 0U : abort_code::kOutOfRange;
  });
  objects_.add(0x6099, 0, {.bytes = 1, .access = Access::constant, .value = 2});
  rw(0x6099, 1, 4, 1000, not_zero);
  rw(0x6099, 2, 4, 100, not_zero);
  rw(0x609A, 0, 4, 10000, not_zero);
  if (settings_.tells_limits) {
    ro(0x60FD, 4, [this] { return (low_active() ? 1U : 0U) | (high_active() ? 2U : 0U); });
  }
  constexpr std::uint32_t kModes = 1U << (kProfilePosition - 1) | 1U << (kHomingMode - 1);
  objects_.add(0x6502, 0, {.bytes = 4, .access = Access::constant, .value = kModes});
}

void Cia402Drive::power_up(Time now) {
  now_ = now;
  add_objects();
  if (!settings_.is_absolute) zero_ = motor_.position(now);
  knows_zero_ = settings_.is_absolute;
  state_ = State::switch_on_disabled;
  to_.reset();
  control_ = 0;
  mode_ = 0;
  leave_operation();
  attained_ = homing_error_ = false;
  error_ = 0;
}

void Cia402Drive::power_down(Time now) {
  now_ = now;
  motor_.put(now, motor_.position(now));
  state_ = State::not_ready;
  to_.reset();
}

void Cia402Drive::set_operational(bool operational) {
  const bool lost = is_operational_ && !operational;
  is_operational_ = operational;
  if (lost && state_ == State::operation_enabled) {
    trip(kCommunication, 0x10);
    has_cause_ = false;  // it is over as soon as it is said
  }
}

void Cia402Drive::tick(Time now) {
  // Cycles that a busy machine kept waiting are made up for: a switch is seen where it is all the same.
  while (state_ != State::not_ready && now_ < now) {
    now_ = std::min(now, now_ + kCycle);
    step_state();
    step_mode();
    keep_limits();
  }
  now_ = now;
}

void Cia402Drive::control(std::uint16_t controlword) {
  const auto rising = static_cast<std::uint16_t>(controlword & ~control_);
  const auto falling = static_cast<std::uint16_t>(control_ & ~controlword);
  control_ = controlword;
  if (orders_quick_stop(controlword)) {
    ++stops_;
    if (state_ == State::operation_enabled) begin_quick_stop();
  }
  if ((rising & kFaultReset) != 0 && state_ == State::fault && !has_cause_) {
    error_ = 0;
    go(State::switch_on_disabled, settings_.transition);
    if (on_emergency) on_emergency(0, 0);
  }
  if (state_ != State::operation_enabled) return;
  if (mode_ == kProfilePosition && (rising & kNewSetPoint) != 0 && !taken_) {
    const double acceleration = objects_.value(0x6083);
    std::int32_t target = objects_.signed_value(0x607A);
    if ((controlword & kRelative) != 0) target += reported();
    offered_ = {target, static_cast<double>(objects_.value(0x6081)), acceleration,
                (controlword & kAtOnce) != 0};
  }
  if (mode_ == kHomingMode && (rising & kNewSetPoint) != 0) start_homing();
  if (mode_ == kHomingMode && (falling & kNewSetPoint) != 0 && homing_ != Homing::none) {
    motor_.stop(now_, objects_.value(0x609A));
    homing_ = Homing::none;
  }
}

std::uint16_t Cia402Drive::statusword() {
  unsigned word = 0x0010;
  switch (state_) {
    case State::not_ready:
      word |= 0x00;
      break;
    case State::switch_on_disabled:
      word |= 0x40;
      break;
    case State::ready:
      word |= 0x21;
      break;
    case State::switched_on:
      word |= 0x23;
      break;
    case State::operation_enabled:
      word |= 0x27;
      break;
    case State::quick_stop:
      word |= 0x07;
      break;
    case State::fault_reaction:
      word |= 0x0F;
      break;
    case State::fault:
      word |= 0x08;
      break;
  }
  if (is_operational_) word |= kRemote;
  if (limited_) word |= kLimited;
  const bool is_on = state_ == State::operation_enabled;
  const bool rests = mode_ == kHomingMode ? homing_ == Homing::none && stands()
                     : halted_            ? stands()
                                          : reached_;
  if (is_on ? rests : stands()) word |= kReached;
  if (mode_ == kProfilePosition && is_on && taken_) word |= kBit12;
  if (mode_ == kProfilePosition && is_on && following_error_) word |= kBit13;
  if (mode_ == kHomingMode && attained_) word |= kBit12;
  if (mode_ == kHomingMode && homing_error_) word |= kBit13;
  if (settings_.referenced_bit != 0 && knows_zero_)
    word |= 1U << static_cast<unsigned>(settings_.referenced_bit);
  return static_cast<std::uint16_t>(word);
}

void Cia402Drive::go(State to, milliseconds takes) {
  to_ = to;
  until_ = now_ + takes;
}

void Cia402Drive::step_state() {
  if (to_) {
    if (now_ < until_) return;
    state_ = *std::exchange(to_, std::nullopt);
  }
  const milliseconds usual = settings_.transition;
  switch (state_) {
    case State::not_ready:
      return;
    case State::switch_on_disabled:
      if (orders_shutdown(control_)) go(State::ready, usual);
      return;
    case State::ready:
      if (orders_disable_voltage(control_) || orders_quick_stop(control_))
        go(State::switch_on_disabled, usual);
      if (orders_switch_on(control_) || orders_operation(control_)) go(State::switched_on, usual);
      return;
    case State::switched_on:
      if (orders_disable_voltage(control_) || orders_quick_stop(control_))
        go(State::switch_on_disabled, usual);
      if (orders_shutdown(control_)) go(State::ready, usual);
      if (orders_operation(control_) && is_operational_) go(State::operation_enabled, settings_.brake);
      return;
    case State::operation_enabled:
      if (orders_disable_voltage(control_) || orders_shutdown(control_) || orders_switch_on(control_)) {
        leave_operation();
        motor_.stop(now_, kCoasting);
        state_ = State::switched_on;  // from where the next step leads on
        if (!orders_switch_on(control_)) {
          state_ = orders_shutdown(control_) ? State::ready : State::switch_on_disabled;
        }
      }
      return;
    case State::quick_stop: {
      const auto option = objects_.signed_value(0x605A);
      if (orders_disable_voltage(control_)) {
        motor_.stop(now_, kCoasting);
        go(State::switch_on_disabled, usual);
      } else if (option < 5) {
        if (stands()) go(State::switch_on_disabled, usual);
      } else if (orders_operation(control_) && settings_.leads_back) {
        go(State::operation_enabled, usual);
      }
      return;
    }
    case State::fault_reaction:
      if (stands()) go(State::fault, usual);
      return;
    case State::fault:
      return;
  }
}

std::int32_t Cia402Drive::reported() {
  return static_cast<std::int32_t>(std::lround(motor_.position(now_) - zero_));
}

double Cia402Drive::quick_deceleration() {
  switch (objects_.signed_value(0x605A)) {
    case 1:
    case 5:
      return objects_.value(0x6084);
    case 2:
    case 6:
      return objects_.value(0x6085);
    default:
      return kStrongest;
  }
}

void Cia402Drive::begin_quick_stop() {
  leave_operation();
  if (objects_.signed_value(0x605A) == 0) {
    motor_.stop(now_, kCoasting);
    state_ = State::switch_on_disabled;
    return;
  }
  motor_.stop(now_, quick_deceleration());
  state_ = State::quick_stop;
}

void Cia402Drive::leave_operation() {
  offered_.reset();
  next_.reset();
  active_.reset();
  taken_ = limited_ = halted_ = false;
  reached_ = true;
  homing_ = Homing::none;
  to_.reset();
}

void Cia402Drive::trip(std::uint16_t code, std::uint8_t error_register) {
  has_cause_ = true;
  if (state_ == State::not_ready || state_ == State::fault || state_ == State::fault_reaction) return;
  leave_operation();
  motor_.stop(now_, quick_deceleration());
  state_ = State::fault_reaction;
  error_ = code;
  if (on_emergency) on_emergency(code, error_register);
}

void Cia402Drive::step_mode() {
  const auto asked = static_cast<std::int8_t>(objects_.signed_value(0x6060));
  if (asked != mode_) {
    mode_ = asked;
    if (settings_.forgets_attained) attained_ = false;
    if (state_ == State::operation_enabled && !stands()) motor_.stop(now_, objects_.value(0x6084));
    offered_.reset();
    next_.reset();
    active_.reset();
    taken_ = false;
    homing_ = Homing::none;
    reached_ = true;
  }
  if (state_ != State::operation_enabled) return;
  if (mode_ == kProfilePosition) step_set_points();
  if (mode_ == kHomingMode) step_homing();
}

void Cia402Drive::step_set_points() {
  const bool halt = (control_ & kHalt) != 0;
  if (halt != halted_) {
    halted_ = halt;
    if (halt) motor_.stop(now_, objects_.value(0x6084));
    if (!halt && active_) apply(*active_);
  }
  if (offered_) {
    const SetPoint set_point = *std::exchange(offered_, std::nullopt);
    taken_ = true;
    if (set_point.at_once || reached_ || !active_) {
      next_.reset();
      apply(set_point);
    } else {
      next_ = set_point;
    }
  }
  if (active_ && !halted_ && stands() && !limited_ && reported() == active_->target) {
    reached_ = true;
    if (next_) apply(*std::exchange(next_, std::nullopt));
  }
  if ((control_ & kNewSetPoint) == 0 && !next_) taken_ = false;
}

void Cia402Drive::apply(const SetPoint& set_point) {
  active_ = set_point;
  reached_ = false;
  limited_ = false;
  const double target = zero_ + set_point.target, here = motor_.position(now_);
  if ((target < here && low_active()) || (target > here && high_active())) {
    limited_ = true;
    if (!stands()) motor_.stop(now_, objects_.value(0x6085));
    return;
  }
  if (!halted_) motor_.move_to(now_, target, set_point.velocity, set_point.acceleration);
}

void Cia402Drive::keep_limits() {
  if (homing_ != Homing::none || limited_ || stands()) return;
  const double speed = motor_.velocity(now_);
  if ((speed < 0 && low_active()) || (speed > 0 && high_active())) {
    limited_ = true;
    next_.reset();
    motor_.stop(now_, objects_.value(0x6085));
  }
}

void Cia402Drive::start_homing() {
  attained_ = homing_error_ = limited_ = false;
  knows_zero_ = false;
  const auto method = objects_.signed_value(0x6098);
  if (method == 35 || method == 37) {
    zero_ = motor_.position(now_) - objects_.signed_value(0x607C);
    homing_ = Homing::brake;
    return;
  }
  homing_ = Homing::seek;
  const double way = method == 17 ? -1 : 1;
  motor_.run(now_, way * objects_.value(0x6099, 1), objects_.value(0x609A));
}

void Cia402Drive::step_homing() {
  const bool to_low = objects_.signed_value(0x6098) == 17;
  const bool active = to_low ? low_active() : high_active();
  switch (homing_) {
    case Homing::none:
      return;
    case Homing::seek:
      if (active) {
        homing_ = Homing::release;
        motor_.run(now_, (to_low ? 1 : -1) * static_cast<double>(objects_.value(0x6099, 2)),
                   objects_.value(0x609A));
      } else if (stands()) {
        end_homing(false);  // a hard stop, and no switch before it
      }
      return;
    case Homing::release:
      if (active) {
        if (stands()) end_homing(false);
        return;
      }
      zero_ = edge_passed(to_low) - objects_.signed_value(0x607C);
      homing_ = Homing::brake;
      motor_.stop(now_, objects_.value(0x609A));
      return;
    case Homing::brake:
      if (stands()) end_homing(true);
      return;
  }
}

// A drive's hardware catches the edge of a switch to the count, between two of its cycles.
double Cia402Drive::edge_passed(bool low) {
  const double here = motor_.position(now_), edge = low ? settings_.low_switch : settings_.high_switch;
  const double in_a_cycle = 0.002 * std::abs(motor_.velocity(now_)) + 1;
  return std::abs(here - edge) <= in_a_cycle ? edge : std::round(here);
}

void Cia402Drive::end_homing(bool attained) {
  homing_ = Homing::none;
  attained_ = knows_zero_ = attained;
  homing_error_ = !attained;
}

}  // namespace rig::sim::wire
