#include "sim/wire/modbus_leadshine.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rig::sim::wire {

namespace {

constexpr std::uint16_t kCountsPerTurn = 0x0001, kDirection = 0x0007, kForcedEnable = 0x000F;
constexpr std::uint16_t kInputs = 0x0179, kPeakCurrent = 0x0191, kBaud = 0x01BD, kSlaveId = 0x01BF;
constexpr std::uint16_t kJogVelocity = 0x01E1, kStatus = 0x1003;
constexpr std::uint16_t kCommandedHigh = 0x1012, kFeedbackHigh = 0x1014;
constexpr std::uint16_t kControl = 0x1801, kAlarm = 0x2203;
constexpr std::uint16_t kPrGlobal = 0x6000, kPrControl = 0x6002, kSoftHigh = 0x6006, kSoftLow = 0x6008;
constexpr std::uint16_t kHomeMode = 0x600A, kHomingVelocity = 0x600F, kHomingAcceleration = 0x6011;
constexpr std::uint16_t kHomingLast = 0x6012, kPaths = 0x6200;
constexpr std::size_t kPathCount = 16, kPathWords = 8;

constexpr std::uint16_t kStartPath = 0x0010, kStartHoming = 0x0020, kQuickStop = 0x0040;
constexpr std::uint16_t kResetAlarm = 0x1111;
constexpr std::uint16_t kOverCurrent = 0x01;
constexpr std::uint16_t kSoftLimitsOn = 0x0002;
// The inputs to which this drive's limit switches are wired.
constexpr std::uint16_t kHighLimitInput = 0x0004, kLowLimitInput = 0x0008;

constexpr std::uint16_t kQuickStopMs = 20;

}  // namespace

LeadshineDrive::LeadshineDrive(const Setup& setup)
    : setup_(setup), motor_((setup.travel.low + setup.travel.high) / 2, setup.travel) {
  power_up(std::chrono::steady_clock::now());
}

void LeadshineDrive::power_up(Time now) {
  registers_ = {{kCountsPerTurn, 10000},
                {kDirection, 0},
                {kForcedEnable, 0},
                {kInputs, 0},
                {kPeakCurrent, 32},
                {kBaud, 2},
                {kSlaveId, 1},
                {kJogVelocity, 60},
                {kStatus, 0},
                {kControl, 0},
                {kAlarm, 0},
                {kPrGlobal, 0},
                {kPrControl, 0}};
  for (int i = 0; i < 4; ++i) registers_[static_cast<std::uint16_t>(kCommandedHigh + i)] = 0;
  for (std::uint16_t at = kSoftHigh; at <= kHomingLast; ++at) registers_[at] = 0;
  registers_[kHomingVelocity] = 200;
  registers_[kHomingVelocity + 1] = 50;
  registers_[kHomingAcceleration] = registers_[kHomingLast] = 100;
  for (std::size_t i = 0; i < kPathCount * kPathWords; ++i) {
    registers_[static_cast<std::uint16_t>(kPaths + i)] = 0;
  }
  motor_.put(now, motor_.position(now));
  zero_ = motor_.position(now);
  pending_.reset();
  doing_ = Doing::nothing;
  command_complete_ = path_complete_ = homing_complete_ = false;
  alarm_ = alarm_cause_;
}

double LeadshineDrive::counts_per_s(std::uint16_t rpm) const {
  return rpm / 60.0 * registers_.at(kCountsPerTurn);
}

double LeadshineDrive::counts_per_s2(std::uint16_t ms_per_1000rpm) const {
  const double seconds = std::max<double>(ms_per_1000rpm, 1) / 1000;
  return counts_per_s(1000) / seconds;
}

std::int32_t LeadshineDrive::long_at(std::uint16_t address) const {
  const std::uint32_t high = registers_.at(address),
                      low = registers_.at(static_cast<std::uint16_t>(address + 1));
  return static_cast<std::int32_t>(high << 16U | low);
}

void LeadshineDrive::halt(Time now) {
  pending_.reset();
  motor_.stop(now, counts_per_s2(kQuickStopMs));
  if (doing_ != Doing::nothing) doing_ = Doing::stopping;
}

void LeadshineDrive::advance(Time now) {
  const bool wanted = registers_[kForcedEnable] != 0 && !alarm_;
  if (!wanted) energised_by_.reset();
  if (wanted && !energised_by_) energised_by_ = now + setup_.energising;
  energised_ = wanted && now >= *energised_by_;
  if (pending_ && now >= pending_->due) {
    const std::uint16_t command = pending_->command;
    const Time due = pending_->due;
    pending_.reset();
    carry_out(command, due);
  }
  if (!energised_) {
    motor_.put(now, motor_.position(now));
    doing_ = Doing::nothing;
    return;
  }
  if (doing_ == Doing::nothing || motor_.moving(now)) return;
  const Doing done = std::exchange(doing_, Doing::nothing);
  if (done == Doing::homing) {
    zero_ = motor_.position(now);
    homing_complete_ = true;
  } else if (done == Doing::path) {
    command_complete_ = path_complete_ = true;
  }
}

void LeadshineDrive::carry_out(std::uint16_t command, Time now) {
  if (!energised_) return;
  command_complete_ = path_complete_ = false;
  if (command == kStartHoming) {
    homing_complete_ = false;
    doing_ = Doing::homing;
    motor_.move_to(now, setup_.home, counts_per_s(registers_[kHomingVelocity]),
                   counts_per_s2(registers_[kHomingAcceleration]));
    return;
  }
  start_path(static_cast<std::size_t>(command - kStartPath), now);
}

void LeadshineDrive::start_path(std::size_t path, Time now) {
  const auto at = static_cast<std::uint16_t>(kPaths + path * kPathWords);
  const std::uint16_t mode = registers_[at];
  double target = long_at(static_cast<std::uint16_t>(at + 1)) + zero_;
  if (mode == 0x0041) target = motor_.position(now) + target - zero_;
  if ((registers_[kPrGlobal] & kSoftLimitsOn) != 0) {
    target = std::clamp(target, long_at(kSoftLow) + zero_, long_at(kSoftHigh) + zero_);
  }
  const double way = target - motor_.position(now);
  if ((high_limit_ && way > 0) || (low_limit_ && way < 0)) return;
  doing_ = Doing::path;
  motor_.move_to(now, target, counts_per_s(registers_[static_cast<std::uint16_t>(at + 3)]),
                 counts_per_s2(registers_[static_cast<std::uint16_t>(at + 4)]));
}

std::uint16_t LeadshineDrive::status() const {
  return static_cast<std::uint16_t>((alarm_ ? 0x01 : 0) | (energised_ ? 0x02 : 0) |
                                    (doing_ != Doing::nothing ? 0x04 : 0) | (command_complete_ ? 0x10 : 0) |
                                    (path_complete_ ? 0x20 : 0) | (homing_complete_ ? 0x40 : 0));
}

std::int32_t LeadshineDrive::readback(Time now) {
  return static_cast<std::int32_t>(std::lround(motor_.position(now) - zero_));
}

std::optional<ModbusRegisters::Words> LeadshineDrive::read(bool input, std::uint16_t address,
                                                           std::size_t count) {
  if (input) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  registers_[kStatus] = status();
  registers_[kAlarm] = alarm_ ? kOverCurrent : 0;
  registers_[kInputs] =
      static_cast<std::uint16_t>((high_limit_ ? kHighLimitInput : 0) | (low_limit_ ? kLowLimitInput : 0));
  const auto shown = static_cast<std::uint32_t>(readback(now));
  for (const std::uint16_t at : {kCommandedHigh, kFeedbackHigh}) {
    registers_[at] = static_cast<std::uint16_t>(shown >> 16U);
    registers_[static_cast<std::uint16_t>(at + 1)] = static_cast<std::uint16_t>(shown & 0xFFFFU);
  }
  Words words;
  for (std::size_t i = 0; i < count; ++i) {
    const auto found = registers_.find(static_cast<std::uint16_t>(address + i));
    if (found == registers_.end()) return std::nullopt;
    words.push_back(found->second);
  }
  return words;
}

std::optional<ModbusException> LeadshineDrive::command(std::uint16_t word, Time now) {
  if (word == kQuickStop) {
    ++stops_;
    halt(now);
    return std::nullopt;
  }
  const bool path = word >= kStartPath && word < kStartPath + kPathCount;
  if (!path && word != kStartHoming) return ModbusException::illegal_value;
  if (path) {
    const auto at = static_cast<std::uint16_t>(kPaths + (word - kStartPath) * kPathWords);
    const std::uint16_t mode = registers_[at];
    const bool known = mode == 0x0001 || mode == 0x0041;
    if (!known || registers_[static_cast<std::uint16_t>(at + 3)] == 0) return ModbusException::illegal_value;
  }
  pending_ = Pending{word, now + setup_.reaction};
  advance(now);
  return std::nullopt;
}

std::optional<ModbusException> LeadshineDrive::control(std::uint16_t word) {
  if (word != kResetAlarm) return ModbusException::illegal_value;
  alarm_ = alarm_cause_;
  return std::nullopt;
}

std::optional<ModbusException> LeadshineDrive::write(std::uint16_t address, const Words& words) {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto at = static_cast<std::uint16_t>(address + i);
    const bool read_only =
        at == kStatus || at == kAlarm || at == kInputs || (at >= kCommandedHigh && at < kFeedbackHigh + 2);
    if (read_only || registers_.count(at) == 0) return ModbusException::illegal_address;
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto at = static_cast<std::uint16_t>(address + i);
    // A path's last word, where it is not 0, goes to the PR control: path and trigger in one request.
    const bool trigger = at == kPrControl || (at == kPaths + kPathWords - 1 && words[i] != 0);
    if (trigger) {
      if (const auto refused = command(words[i], now)) return refused;
    } else if (at == kControl) {
      if (const auto refused = control(words[i])) return refused;
    }
    if (at != kControl) registers_[at] = words[i];
  }
  advance(now);
  return std::nullopt;
}

double LeadshineDrive::position() {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  return motor_.position(now) - zero_;
}

bool LeadshineDrive::moving() {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  return motor_.moving(now);
}

bool LeadshineDrive::homed() {
  const std::lock_guard lock(mutex_);
  advance(std::chrono::steady_clock::now());
  return homing_complete_;
}

bool LeadshineDrive::enabled() {
  const std::lock_guard lock(mutex_);
  advance(std::chrono::steady_clock::now());
  return energised_;
}

int LeadshineDrive::stops_seen() {
  const std::lock_guard lock(mutex_);
  return stops_;
}

void LeadshineDrive::set_limit(bool high, bool active) {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  advance(now);
  (high ? high_limit_ : low_limit_) = active;
  // A motion that would start into a pressed switch is not begun.
  const double speed = motor_.velocity(now);
  if (!active || (high ? speed <= 0 : speed >= 0)) return;
  motor_.put(now, motor_.position(now));
  doing_ = Doing::nothing;
}

void LeadshineDrive::set_alarm_cause(bool on) {
  const std::lock_guard lock(mutex_);
  alarm_cause_ = on;
  alarm_ = alarm_ || on;
  advance(std::chrono::steady_clock::now());
}

void LeadshineDrive::power_cycle() {
  const std::lock_guard lock(mutex_);
  power_up(std::chrono::steady_clock::now());
}

void LeadshineDrive::reset() {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  alarm_cause_ = low_limit_ = high_limit_ = false;
  motor_.put(now, (setup_.travel.low + setup_.travel.high) / 2);
  power_up(now);
}

}  // namespace rig::sim::wire
