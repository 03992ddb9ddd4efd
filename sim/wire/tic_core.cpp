#include "sim/wire/tic_core.h"

#include <algorithm>
#include <cmath>

namespace rig::sim::wire {

using std::chrono::milliseconds;
using namespace tic_setting;

namespace {

enum Error : std::uint32_t {
  kDeenergized = 1U << 0U,
  kDriverError = 1U << 1U,
  kLowVin = 1U << 2U,
  kKillSwitch = 1U << 3U,
  kTimedOut = 1U << 6U,
  kSafeStart = 1U << 7U,
  kErrLineHigh = 1U << 8U,
};
constexpr std::uint32_t kSoftErrors = kKillSwitch | kTimedOut | kSafeStart;

enum class SoftResponse : std::uint8_t { deenergize = 0, halt = 1, decelerate = 2, go_to = 3 };

// The pins that the switches are wired to, as bits of the settings' maps.
constexpr std::uint8_t kPinScl = 1U << 0U, kPinTx = 1U << 2U, kPinRx = 1U << 3U;
constexpr std::uint32_t kFastest = 500'000'000;
constexpr std::uint32_t kGentlest = 100;
constexpr double kSpeedUnits = 10000, kAccelUnits = 100;
constexpr int kLowestVin_mv = 7000;
constexpr milliseconds kStep{1};
constexpr milliseconds kStartingUp{10};      // the coils' current settles
constexpr milliseconds kSafeStartOpen{200};  // after "exit safe start"
constexpr milliseconds kAtTheSwitch{20};

std::uint32_t read32(const TicSettingBytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value |= static_cast<std::uint32_t>(bytes[at + i]) << (8 * i);
  return value;
}

}  // namespace

TicCore::TicCore(const TicWorld& world, const TicSettingBytes& bytes, Time now)
    : settings(bytes), world_(world), motor_(0, {world.reverse_stop_at, world.forward_stop_at}), now_(now) {
  outside.vin_mv = world.vin_mv;
  power_up();
}

void TicCore::load_settings() {
  temporary.step_mode = settings[kStepMode];
  temporary.current_limit = settings[kCurrentLimit];
  temporary.decay_mode = settings[kDecayMode];
  temporary.starting_speed = std::min(read32(settings, kStartingSpeed), kFastest);
  temporary.max_speed = std::min(read32(settings, kMaxSpeed), kFastest);
  set_max_accel(read32(settings, kMaxAccel));
  set_max_decel(read32(settings, kMaxDecel));
}

void TicCore::advance(Time until) {
  // Nothing changes of itself for long; a quiet hour is not stepped through.
  constexpr milliseconds kMost{60'000};
  if (until - now_ > kMost) now_ = until - kMost;
  while (now_ + kStep <= until) {
    now_ += kStep;
    step();
  }
}

void TicCore::power_up() {
  powered_at_ = last_command_ = now_;
  safe_start_open_until_ = {};
  occurred_ = 0;
  deenergized_ = driver_error_ = timed_out_ = forced_safe_start_ = false;
  reset();
  occurred_ = 0;
  step();
}

milliseconds TicCore::up_time() const {
  return std::chrono::duration_cast<milliseconds>(now_ - powered_at_);
}

bool TicCore::serial_control() const {
  return settings[kControlMode] == 0;
}

bool TicCore::limit(bool forward) {
  const std::uint8_t pin = forward ? kPinRx : kPinTx;
  if (!world_.has_switches || (settings[forward ? kForwardMap : kReverseMap] & pin) == 0) return false;
  const double place = motor_.position(now_);
  const bool closed = forward ? outside.forward_pressed || place >= world_.forward_switch_at
                              : outside.reverse_pressed || place <= world_.reverse_switch_at;
  // Closing pulls the pin low, which is active unless the pin is said to be active high.
  const bool active_low = (settings[kSwitchPolarity] & pin) == 0;
  return closed == active_low;
}

bool TicCore::blocked(double direction) {
  return (direction > 0 && limit(true)) || (direction < 0 && limit(false));
}

std::uint8_t TicCore::flags() {
  return static_cast<std::uint8_t>((coils_ ? 1U : 0U) | (uncertain_ ? 2U : 0U) | (limit(true) ? 4U : 0U) |
                                   (limit(false) ? 8U : 0U) | (homing_ != Homing::none ? 16U : 0U));
}

std::int32_t TicCore::position() {
  return static_cast<std::int32_t>(std::lround(motor_.position(now_) - offset_));
}

void TicCore::put_motor(double position) {
  motor_.put(now_, position);
  step();
}

// --- the motor

double TicCore::accel() const {
  return temporary.max_accel / kAccelUnits;
}
double TicCore::decel() const {
  return temporary.max_decel / kAccelUnits;
}

void TicCore::halt_abruptly() {
  motor_.put(now_, motor_.position(now_));
  planning_ = Planning::off;
}

void TicCore::halt_input() {
  input_ = Input::halt;
  input_value_ = 0;
}

void TicCore::run(std::int32_t velocity) {
  planning_ = Planning::velocity;
  target_ = velocity;
  const double most = temporary.max_speed / kSpeedUnits;
  const double wanted = std::clamp(velocity / kSpeedUnits, -most, most);
  if (wanted == 0) {
    motor_.stop(now_, decel());
  } else if (!blocked(wanted)) {
    motor_.run(now_, wanted, accel());
  }
}

void TicCore::go_to(std::int32_t position) {
  planning_ = Planning::position;
  target_ = position;
  const double to = position + offset_;
  if (temporary.max_speed == 0 || blocked(to - motor_.position(now_))) return;
  motor_.move_to(now_, to, temporary.max_speed / kSpeedUnits, accel());
}

void TicCore::obey() {
  if (homing_ != Homing::none) return;
  if (input_ == Input::position) go_to(input_value_);
  if (input_ == Input::velocity) run(input_value_);
}

// A plan that a limit switch held up goes on when the switch lets go.
void TicCore::resume_planned() {
  if (operation_ != Operation::normal || motor_.moving(now_)) return;
  if (planning_ == Planning::position && position() != target_) go_to(target_);
  if (planning_ == Planning::velocity && target_ != 0) run(target_);
}

void TicCore::refresh_motion() {
  if (operation_ != Operation::normal || !motor_.moving(now_)) return;
  if (planning_ == Planning::position) go_to(target_);
  if (planning_ == Planning::velocity) run(target_);
}

// --- errors and states

void TicCore::step() {
  watch_limits();
  watch_errors();
  choose_operation();
  advance_homing();
  resume_planned();
}

void TicCore::watch_limits() {
  const double speed = motor_.velocity(now_);
  if (speed == 0 || !blocked(speed)) return;
  motor_.put(now_, motor_.position(now_));
  if (world_.habits.limit_makes_uncertain && homing_ == Homing::none) uncertain_ = true;
}

void TicCore::watch_errors() {
  if (outside.driver_error) {
    driver_error_ = true;
  } else if (settings[kAutoClearDriverError] != 0) {
    driver_error_ = false;
  }
  const milliseconds timeout(settings[kCommandTimeout] | (settings[kCommandTimeout + 1] << 8U));
  if (serial_control() && timeout.count() != 0 && now_ - last_command_ > timeout) timed_out_ = true;
  std::uint32_t found = 0;
  if (deenergized_) found |= kDeenergized;
  if (driver_error_) found |= kDriverError;
  if (outside.vin_mv < kLowestVin_mv) found |= kLowVin;
  if (outside.kill_pressed && (settings[kKillSwitchMap] & kPinScl) != 0) found |= kKillSwitch;
  if (timed_out_) found |= kTimedOut;
  if (outside.err_line_high && settings[kIgnoreErrLine] == 0) found |= kErrLineHigh;
  const bool guarded = settings[kDisableSafeStart] == 0 && serial_control();
  const bool runs = operation_ == Operation::normal && found == 0 && !forced_safe_start_;
  if (guarded && !runs && now_ >= safe_start_open_until_) found |= kSafeStart;
  errors_ = found;
  occurred_ |= found;
}

TicCore::Operation TicCore::demanded() const {
  if ((errors_ & (kDriverError | kLowVin)) != 0) return Operation::reset;
  if ((errors_ & kDeenergized) != 0) return Operation::deenergized;
  if ((errors_ & kSoftErrors) != 0) return Operation::soft_error;
  if ((errors_ & kErrLineHigh) != 0) return Operation::waiting_for_err_line;
  return Operation::normal;
}

void TicCore::choose_operation() {
  const Operation before = operation_;
  const Operation next = demanded();
  if (next != Operation::normal) {
    operation_ = next;
    if (next == Operation::reset || next == Operation::deenergized) return let_go();
    if (before == Operation::normal) respond_softly();
    return;
  }
  if (before == Operation::normal) return;
  if (before != Operation::starting_up) {
    operation_ = Operation::starting_up;
    starting_until_ = now_ + kStartingUp;
    coils_ = true;
  }
  if (now_ < starting_until_) return;
  operation_ = Operation::normal;
  obey();
}

void TicCore::let_go() {
  coils_ = false;
  uncertain_ = true;
  homing_ = Homing::none;
  halt_abruptly();
}

void TicCore::respond_softly() {
  homing_ = Homing::none;
  switch (static_cast<SoftResponse>(settings[kSoftErrorResponse])) {
    case SoftResponse::deenergize:
      return let_go();
    case SoftResponse::halt:
      uncertain_ = true;
      return halt_abruptly();
    case SoftResponse::decelerate:
      return run(0);
    case SoftResponse::go_to:
      return go_to(static_cast<std::int32_t>(read32(settings, kSoftErrorPosition)));
  }
}

// --- homing, step by step as the guide has it

void TicCore::go_home(bool forward) {
  if (operation_ != Operation::normal) return;
  uncertain_ = true;
  homing_ = Homing::towards;
  homing_forward_ = forward;
  run_home(kHomingTowards, forward);
}

void TicCore::run_home(std::size_t speed_at, bool forward) {
  const auto speed = static_cast<std::int32_t>(std::min(read32(settings, speed_at), kFastest));
  run(forward ? speed : -speed);
}

void TicCore::advance_homing() {
  if (homing_ == Homing::none) return;
  const bool at_switch = limit(homing_forward_);
  switch (homing_) {
    case Homing::none:
      return;
    case Homing::towards:
      if (!at_switch) return;
      homing_ = Homing::waiting;
      homing_until_ = now_ + kAtTheSwitch;
      return;
    case Homing::waiting:
      if (now_ < homing_until_) return;
      homing_ = Homing::away;
      return run_home(kHomingAway, !homing_forward_);
    case Homing::away:
      if (at_switch) return;
      homing_ = Homing::none;
      halt_abruptly();
      halt_input();
      offset_ = motor_.position(now_);
      uncertain_ = false;
      return;
  }
}

// --- commands

// Some commands clear the command timeout and begin it anew.
void TicCore::heard() {
  last_command_ = now_;
  timed_out_ = false;
}

void TicCore::reset_command_timeout() {
  heard();
}

void TicCore::set_target(Input kind, std::int32_t value) {
  heard();
  if (!serial_control() || homing_ != Homing::none) return;
  input_ = kind;
  input_value_ = value;
  if (operation_ == Operation::normal) obey();
}

void TicCore::halt(std::optional<std::int32_t> set_position) {
  heard();
  if (!serial_control()) return;
  if (homing_ != Homing::none && !world_.habits.halt_ends_homing) return;
  homing_ = Homing::none;
  halt_abruptly();
  halt_input();
  uncertain_ = !set_position;
  if (set_position) offset_ = motor_.position(now_) - *set_position;
}

void TicCore::energize(bool on) {
  if (on) heard();
  deenergized_ = !on;
  step();
}

void TicCore::exit_safe_start() {
  heard();
  forced_safe_start_ = false;
  safe_start_open_until_ = now_ + kSafeStartOpen;
  step();
}

void TicCore::enter_safe_start() {
  forced_safe_start_ = true;
  safe_start_open_until_ = {};
  step();
}

void TicCore::clear_driver_error() {
  driver_error_ = outside.driver_error;
  step();
}

void TicCore::reset() {
  load_settings();
  let_go();
  halt_input();
  operation_ = Operation::reset;
  offset_ = motor_.position(now_);
  heard();
  occurred_ = 0;
  safe_start_open_until_ = {};
}

void TicCore::set_max_speed(std::uint32_t speed) {
  temporary.max_speed = std::min(speed, kFastest);
  refresh_motion();
}

void TicCore::set_max_accel(std::uint32_t accel_units) {
  temporary.max_accel = std::max(accel_units, kGentlest);
  refresh_motion();
}

void TicCore::set_max_decel(std::uint32_t decel_units) {
  temporary.max_decel = decel_units == 0 ? temporary.max_accel : std::max(decel_units, kGentlest);
}

}  // namespace rig::sim::wire
