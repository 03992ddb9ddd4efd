#include "sim/wire/sixk.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "sim/wire/promptness.h"

namespace rig::sim::wire {

using std::chrono::milliseconds;

namespace {

constexpr std::size_t kLongestLine = 200;
constexpr std::ptrdiff_t kMostHeard = 1000;
}  // namespace

Sixk::AxisState::AxisState(const AxisSetup& as)
    : setup(as), motor(as.stands_at, {static_cast<double>(as.low), static_cast<double>(as.high)}) {}

Sixk::Sixk(Setup setup) : setup_(std::move(setup)), line_(setup_.link), answers_(line_, setup_.lateness) {
  for (const AxisSetup& axis : setup_.axes) axes_.emplace_back(axis);
  make_fresh();
  thread_ = std::thread([this] { run(); });
}

Sixk::~Sixk() {
  quit_ = true;
  thread_.join();
}

void Sixk::run() {
  answer_promptly();
  while (!quit_) {
    const std::string bytes = line_.read(milliseconds(2));
    const std::lock_guard lock(mutex_);
    const Time now = std::chrono::steady_clock::now();
    if (echo_) answers_.say(bytes);
    for (const char c : bytes) {
      if (c == '\r' || c == '\n') {
        if (!input_.empty()) line(now, std::exchange(input_, {}));
      } else if (c != ' ' && input_.size() < kLongestLine) {
        input_.push_back(static_cast<char>(std::toupper(static_cast<unsigned char>(c))));
      }
    }
    step(now);
  }
}

void Sixk::step(Time now) {
  answers_.tick(now);
  for (AxisState& axis : axes_) step_axis(now, axis);
  while (!buffered_.empty() && (continuous_execution_ || !any_moving(now))) {
    const std::string next = buffered_.front();
    buffered_.erase(buffered_.begin());
    execute(now, next);
  }
}

void Sixk::step_axis(Time now, AxisState& a) {
  const double at = a.motor.position(now);
  const double velocity = a.motor.velocity(now);
  const bool moving = a.motor.moving(now);
  const bool upwards = velocity != 0              ? velocity > 0
                       : a.homing != Homing::none ? a.homing_upwards
                                                  : a.motor.target() > at;
  const bool limited = moving && (a.hard_limits != 0) && (upwards ? a.pressed_high : a.pressed_low);
  if (limited) a.motor.put(now, std::round(at));
  const bool seeking = a.homing == Homing::seeking || a.homing == Homing::turned;
  if (seeking && !a.home_hidden && (upwards ? at >= 0 : at <= 0) && std::abs(at) < 0.5 * a.resolution) {
    // The switch is passed: back to its edge.
    a.motor.move_to(now, 0, a.home_velocity * a.resolution, a.home_acceleration * a.resolution);
    a.homing = Homing::leaving;
  } else if (seeking && !a.motor.moving(now)) {
    if (a.homing == Homing::turned) {
      a.homing = Homing::none;
    } else {
      a.homing = Homing::turned;
      a.homing_upwards = !a.homing_upwards;
      a.motor.run(now, (a.homing_upwards ? 1 : -1) * a.home_velocity * a.resolution,
                  a.home_acceleration * a.resolution);
    }
  } else if (a.homing == Homing::leaving && !a.motor.moving(now)) {
    a.homing = Homing::none;
    a.homed = !limited;
    if (a.homed) a.offset = 0;
  }
  if (a.was_moving && !a.motor.moving(now)) a.motor.put(now, std::round(a.motor.position(now)));
  a.was_moving = a.motor.moving(now);
}

void Sixk::line(Time now, const std::string& text) {
  heard_.push_back(text);
  if (std::ssize(heard_) > kMostHeard) heard_.erase(heard_.begin(), heard_.begin() + kMostHeard / 2);
  std::string command = text.substr(0, text.find(';'));
  if (const auto prefix = command.find('_'); prefix != std::string::npos && prefix < 4) {
    if (command.substr(0, prefix) != std::to_string(setup_.unit)) return;  // for another one on the line
    command.erase(0, prefix + 1);
  }
  if (command.empty()) return;
  if (command.front() == '!') {
    command.erase(0, 1);
    return execute(now, command);
  }
  buffered_.push_back(command);
}

void Sixk::drive_off(Time now, AxisState& a) {
  a.drive = false;
  a.homing = Homing::none;
  a.lags_until.reset();
  a.motor.put(now, std::round(a.motor.position(now)));
}

std::string Sixk::groups(const std::vector<bool>& bits) {
  std::string text;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    if (i > 0 && i % 4 == 0) text += '_';
    text += bits[i] ? '1' : '0';
  }
  return text;
}

std::string Sixk::status(Time now, AxisState& a) const {
  std::vector<bool> bits(32, false);
  const bool lags = a.lags_until && now < *a.lags_until;
  const bool moving = (a.motor.moving(now) || a.homing != Homing::none) && !lags;
  const auto set = [&](std::size_t bit, bool on) { bits.at(bit - 1) = on; };
  set(1, moving);
  set(2, moving && a.motor.velocity(now) < 0);
  set(5, a.homed);
  set(6, a.absolute);
  set(7, a.continuous);
  set(12, a.stalled);
  set(13, !a.drive);
  set(14, a.faulty);
  set(15, a.pressed_high && a.hard_limits != 0);
  set(16, a.pressed_low && a.hard_limits != 0);
  set(23, a.strayed);
  return groups(bits);
}

double Sixk::counter(Time now, AxisState& a) const {
  const double at = a.motor.position(now) - a.offset;
  if (!a.motor.moving(now)) return std::round(at);
  return a.motor.velocity(now) > 0 ? std::floor(at) : std::ceil(at);
}

bool Sixk::any_moving(Time now) {
  return std::any_of(axes_.begin(), axes_.end(), [&](AxisState& a) { return a.motor.moving(now); });
}

void Sixk::power_up(Time now) {
  input_.clear();
  buffered_.clear();
  echo_ = true;
  continuous_execution_ = false;
  error_level_ = 4;
  end_.assign(1, '\r');
  for (AxisState& a : axes_) {
    const double at = std::round(a.motor.position(now));
    drive_off(now, a);
    a.offset = at;
    a.encoder_offset = at / a.setup.resolution * a.setup.encoder_per_turn;
    a.slip = 0;
    a.resolution = a.setup.resolution;
    a.distance = 0;
    a.velocity = a.home_velocity = 1;
    a.acceleration = a.deceleration = a.home_acceleration = 10;
    a.hard_limits = 3;
    a.absolute = a.continuous = a.homed = a.stalled = a.strayed = false;
    a.was_moving = false;
  }
}

void Sixk::spoil(Answers::Spoil how, int answers) {
  const std::lock_guard lock(mutex_);
  answers_.spoil(how, answers);
}

void Sixk::power_cycle() {
  const std::lock_guard lock(mutex_);
  power_up(std::chrono::steady_clock::now());
}

void Sixk::press(std::size_t axis, bool high, bool pressed) {
  const std::lock_guard lock(mutex_);
  AxisState& a = axes_.at(axis - 1);
  (high ? a.pressed_high : a.pressed_low) = pressed;
}

void Sixk::set_drive_fault(std::size_t axis, bool on) {
  const std::lock_guard lock(mutex_);
  AxisState& a = axes_.at(axis - 1);
  a.faulty = on;
  if (on) drive_off(std::chrono::steady_clock::now(), a);
}

void Sixk::stall(std::size_t axis) {
  const std::lock_guard lock(mutex_);
  AxisState& a = axes_.at(axis - 1);
  const Time now = std::chrono::steady_clock::now();
  a.motor.put(now, std::round(a.motor.position(now)));
  a.offset -= 137;  // steps that were counted and not made
  a.stalled = true;
  a.homing = Homing::none;
}

void Sixk::lose_position(std::size_t axis) {
  const std::lock_guard lock(mutex_);
  AxisState& a = axes_.at(axis - 1);
  drive_off(std::chrono::steady_clock::now(), a);
  a.strayed = true;
}

void Sixk::hide_home(std::size_t axis, bool hidden) {
  const std::lock_guard lock(mutex_);
  axes_.at(axis - 1).home_hidden = hidden;
}

void Sixk::slip_encoder(std::size_t axis, int counts) {
  const std::lock_guard lock(mutex_);
  axes_.at(axis - 1).slip += counts;
}

void Sixk::make_fresh() {
  line_.restore();
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  answers_.forget();
  heard_.clear();
  for (AxisState& a : axes_) {
    a.faulty = a.pressed_low = a.pressed_high = a.home_hidden = false;
    a.motor.put(now, a.setup.stands_at);
    a.stops = 0;
  }
  power_up(now);
}

double Sixk::position(std::size_t axis) {
  const std::lock_guard lock(mutex_);
  return axes_.at(axis - 1).motor.position(std::chrono::steady_clock::now());
}

bool Sixk::moving(std::size_t axis) {
  const std::lock_guard lock(mutex_);
  AxisState& a = axes_.at(axis - 1);
  return a.homing != Homing::none || a.motor.moving(std::chrono::steady_clock::now());
}

int Sixk::stops(std::size_t axis) {
  const std::lock_guard lock(mutex_);
  return axes_.at(axis - 1).stops;
}

bool Sixk::energised(std::size_t axis) {
  const std::lock_guard lock(mutex_);
  return axes_.at(axis - 1).drive;
}

std::vector<std::string> Sixk::heard() {
  const std::lock_guard lock(mutex_);
  return heard_;
}

void Sixk::forget_heard() {
  const std::lock_guard lock(mutex_);
  heard_.clear();
}

}  // namespace rig::sim::wire
