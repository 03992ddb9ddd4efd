#include "sim/wire/modbus_oriental.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rig::sim::wire {

namespace {

// Direct data operation: nine numbers.
constexpr std::uint16_t kDirectNumber = 0x0058, kDirectType = 0x005A, kDirectPosition = 0x005C;
constexpr std::uint16_t kDirectSpeed = 0x005E, kDirectStartRate = 0x0060, kDirectStopRate = 0x0062;
constexpr std::uint16_t kDirectTrigger = 0x0066, kDirectDestination = 0x0068;
constexpr std::uint16_t kInputs = 0x007C, kOutputs = 0x007E, kAlarm = 0x0080;
constexpr std::uint16_t kCommandPosition = 0x00C6, kFeedbackPosition = 0x00CC;
constexpr std::uint16_t kDriverTemperature = 0x00F8, kMotorTemperature = 0x00FA;
constexpr std::uint16_t kAlarmReset = 0x0180;
// Of a CVD: how it searches home.
constexpr std::uint16_t kHomeType = 0x02C0, kHomeDirection = 0x02C2;
constexpr std::int32_t kThreeSensors = 1, kForward = 1;

constexpr std::uint16_t kInHome = 1U << 4, kInStop = 1U << 5, kInFree = 1U << 6, kInAlarmReset = 1U << 7;
constexpr std::uint16_t kOutHomed = 1U << 4, kOutReady = 1U << 5, kOutAlarm = 1U << 7;
constexpr std::uint16_t kOutForwardLimit = 1U << 9, kOutReverseLimit = 1U << 10;
constexpr std::uint16_t kOutMove = 1U << 13, kOutInPosition = 1U << 14;

constexpr std::uint32_t kOverload = 0x30, kHomingIncomplete = 0x4A, kOperationData = 0x70;
constexpr std::int32_t kAbsolute = 1, kRelative = 2;
constexpr double kHomingSpeed = 50000, kHomingRate = 500000;
constexpr std::uint32_t kDegrees31 = 310, kDegrees42 = 425;  // tenths

}  // namespace

OrientalDrive::OrientalDrive(const Setup& setup)
    : setup_(setup), motor_((setup.travel.low + setup.travel.high) / 2, setup.travel) {
  power_up(std::chrono::steady_clock::now());
}

void OrientalDrive::put_long(std::uint16_t address, std::uint32_t number) {
  registers_[address] = static_cast<std::uint16_t>(number >> 16U);
  registers_[static_cast<std::uint16_t>(address + 1)] = static_cast<std::uint16_t>(number & 0xFFFFU);
}

std::int32_t OrientalDrive::long_at(std::uint16_t address) const {
  const std::uint32_t high = registers_.at(address),
                      low = registers_.at(static_cast<std::uint16_t>(address + 1));
  return static_cast<std::int32_t>(high << 16U | low);
}

void OrientalDrive::power_up(Time now) {
  registers_.clear();
  for (std::uint16_t at = kDirectNumber; at <= kDirectDestination; at += 2) put_long(at, 0);
  for (const std::uint16_t at : {kInputs, kOutputs, kAlarm, kCommandPosition, kAlarmReset}) put_long(at, 0);
  if (setup_.cvd) {
    put_long(kHomeType, kThreeSensors);
    put_long(kHomeDirection, kForward);
  } else {
    put_long(kFeedbackPosition, 0);
    put_long(kDriverTemperature, kDegrees42);
    put_long(kMotorTemperature, kDegrees31);
  }
  motor_.put(now, motor_.position(now));
  if (!setup_.absolute || !known_) {
    zero_ = motor_.position(now);
    known_ = false;
  }
  homing_ = false;
  due_.reset();
  inputs_ = 0;
  reset_word_ = false;
  alarm_ = alarm_cause_ ? kOverload : 0;
}

bool OrientalDrive::energised() const {
  return alarm_ == 0 && (inputs_ & kInFree) == 0;
}

void OrientalDrive::raise(std::uint32_t alarm, Time now) {
  alarm_ = alarm;
  due_.reset();
  homing_ = false;
  motor_.put(now, motor_.position(now));
}

void OrientalDrive::brake(Time now) {
  due_.reset();
  homing_ = false;
  motor_.stop(now, std::max<double>(long_at(kDirectStopRate), kHomingRate));
}

void OrientalDrive::advance(Time now) {
  if (due_ && now >= *due_) start(*std::exchange(due_, std::nullopt));
  if (!energised()) {
    motor_.put(now, motor_.position(now));
    homing_ = false;
    return;
  }
  if (homing_ && !motor_.moving(now)) {
    if (std::exchange(comes_back_, false)) return motor_.move_to(now, setup_.home, kHomingSpeed, kHomingRate);
    homing_ = false;
    known_ = true;
    zero_ = motor_.position(now);
  }
}

void OrientalDrive::trigger(Time now) {
  if (!energised() || (inputs_ & kInStop) != 0) return;
  const std::int32_t type = long_at(kDirectType);
  if ((type != kAbsolute && type != kRelative) || long_at(kDirectSpeed) == 0 ||
      long_at(kDirectStartRate) <= 0 || long_at(kDirectStopRate) <= 0) {
    raise(kOperationData, now);
  } else if (type == kAbsolute && !known_) {
    raise(kHomingIncomplete, now);
  } else {
    due_ = now + setup_.reaction;
  }
}

void OrientalDrive::start(Time now) {
  const bool absolute = long_at(kDirectType) == kAbsolute;
  const double target = long_at(kDirectPosition) + (absolute ? zero_ : motor_.position(now));
  const double way = target - motor_.position(now);
  if ((high_limit_ && way > 0) || (low_limit_ && way < 0)) return;
  homing_ = false;
  motor_.move_to(now, target, std::abs(long_at(kDirectSpeed)), long_at(kDirectStartRate));
}

void OrientalDrive::set_inputs(std::uint16_t inputs, Time now) {
  const auto rises = static_cast<std::uint16_t>(inputs & ~inputs_);
  inputs_ = inputs;
  if ((rises & kInAlarmReset) != 0) alarm_ = alarm_cause_ ? kOverload : 0;
  if ((rises & kInStop) != 0) {
    ++stops_;
    brake(now);
  }
  if ((rises & kInHome) != 0 && energised() && (inputs_ & kInStop) == 0) start_homing(now);
}

void OrientalDrive::start_homing(Time now) {
  known_ = comes_back_ = false;
  double target = setup_.home;
  if (setup_.cvd) {
    if (long_at(kHomeType) != kThreeSensors) return raise(kOperationData, now);
    const bool forward = long_at(kHomeDirection) == kForward;
    comes_back_ = forward != (setup_.home >= motor_.position(now));
    if (comes_back_) target = forward ? setup_.travel.high : setup_.travel.low;
  }
  homing_ = true;
  motor_.move_to(now, target, kHomingSpeed, kHomingRate);
}

std::uint16_t OrientalDrive::outputs(Time now) {
  const bool moves = motor_.moving(now);
  const bool ready = energised() && !moves;
  return static_cast<std::uint16_t>((known_ ? kOutHomed : 0) | (ready ? kOutReady : 0) |
                                    (alarm_ != 0 ? kOutAlarm : 0) | (high_limit_ ? kOutForwardLimit : 0) |
                                    (low_limit_ ? kOutReverseLimit : 0) | (moves ? kOutMove : 0) |
                                    (moves ? 0 : kOutInPosition));
}

void OrientalDrive::refresh(Time now) {
  put_long(kInputs, inputs_);
  put_long(kOutputs, outputs(now));
  put_long(kAlarm, alarm_);
  const auto shown = static_cast<std::uint32_t>(std::lround(motor_.position(now) - zero_));
  put_long(kCommandPosition, shown);
  if (!setup_.cvd) put_long(kFeedbackPosition, shown);
}

std::optional<ModbusRegisters::Words> OrientalDrive::read(bool input, std::uint16_t address,
                                                          std::size_t count) {
  if (input) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  refresh(now);
  Words words;
  for (std::size_t i = 0; i < count; ++i) {
    const auto found = registers_.find(static_cast<std::uint16_t>(address + i));
    if (found == registers_.end()) return std::nullopt;
    words.push_back(found->second);
  }
  return words;
}

std::optional<ModbusException> OrientalDrive::write(std::uint16_t address, const Words& words) {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto at = static_cast<std::uint16_t>(address + i);
    const bool direct = at >= kDirectNumber && at <= kDirectDestination + 1;
    const bool switched = (at & ~1U) == kInputs || (at & ~1U) == kAlarmReset;
    const bool parameter = setup_.cvd && ((at & ~1U) == kHomeType || (at & ~1U) == kHomeDirection);
    if (!direct && !switched && !parameter) return ModbusException::illegal_address;
  }
  bool triggered = false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto at = static_cast<std::uint16_t>(address + i);
    registers_[at] = words[i];
    triggered = triggered || at == kDirectTrigger + 1;
    if (at == kInputs + 1) set_inputs(words[i], now);
    if (at == kAlarmReset + 1) {
      if (words[i] == 1 && !reset_word_) alarm_ = alarm_cause_ ? kOverload : 0;
      reset_word_ = words[i] == 1;
    }
  }
  if (triggered && long_at(kDirectTrigger) == 1) trigger(now);
  advance(now);
  return std::nullopt;
}

double OrientalDrive::position() {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  return motor_.position(now) - zero_;
}

bool OrientalDrive::moving() {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  return motor_.moving(now);
}

bool OrientalDrive::homed() {
  const std::lock_guard lock(mutex_);
  advance(std::chrono::steady_clock::now());
  return known_;
}

bool OrientalDrive::enabled() {
  const std::lock_guard lock(mutex_);
  return energised();
}

int OrientalDrive::stops_seen() {
  const std::lock_guard lock(mutex_);
  return stops_;
}

void OrientalDrive::set_limit(bool high, bool active) {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  (high ? high_limit_ : low_limit_) = active;
  // A motion that would start into a pressed switch is not begun.
  const double speed = motor_.velocity(now);
  if (!active || (high ? speed <= 0 : speed >= 0)) return;
  motor_.put(now, motor_.position(now));
  homing_ = false;
}

void OrientalDrive::set_alarm_cause(bool on) {
  const std::lock_guard lock(mutex_);
  alarm_cause_ = on;
  if (on) raise(kOverload, std::chrono::steady_clock::now());
}

void OrientalDrive::power_cycle() {
  const std::lock_guard lock(mutex_);
  power_up(std::chrono::steady_clock::now());
}

void OrientalDrive::reset() {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  alarm_cause_ = low_limit_ = high_limit_ = known_ = false;
  motor_.put(now, (setup_.travel.low + setup_.travel.high) / 2);
  power_up(now);
}

}  // namespace rig::sim::wire
