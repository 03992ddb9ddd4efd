#include "drivers/modbus_axis/motion_watch.h"

#include <cmath>

namespace rig::drivers::modbus {

namespace {

base::Duration milliseconds(int ms) {
  return std::chrono::milliseconds(ms);
}

}  // namespace

void MotionWatch::begin(Command command, base::Time now, const Reading& before) {
  command_ = command;
  began_ = now;
  before_ = before;
  taken_ = false;
  idle_since_.reset();
  homed_here_ = homed_here_ && command != Command::home;
}

void MotionWatch::move(base::Time now, const Reading& before, double target_counts) {
  begin(Command::move, now, before);
  target_counts_ = target_counts;
}

void MotionWatch::home(base::Time now, const Reading& before) {
  begin(Command::home, now, before);
}

void MotionWatch::stop(base::Time now) {
  begin(Command::stop, now, {});
  // Where it stands is measured anew: it may be on its way since the last reading.
  stands_at_.reset();
}

void MotionWatch::forget() {
  command_ = Command::none;
  homed_here_ = false;
  stands_at_.reset();
}

bool MotionWatch::runs(const Reading& reading) const {
  if (reading.moving) return *reading.moving;
  return !reading.complete.value_or(true);
}

bool MotionWatch::proves_taken(const Reading& reading) const {
  const bool homing = command_ == Command::home;
  if (before_.complete.value_or(false) && !reading.complete.value_or(true)) return true;
  if (homing && before_.homed && !reading.homed) return true;
  // What comes to its end meanwhile may be the motion before.
  if (runs(before_)) return false;
  return runs(reading) || reading.complete != before_.complete ||
         (homing && reading.homed != before_.homed) ||
         std::abs(reading.position_counts - before_.position_counts) > times_.tolerance_counts;
}

bool MotionWatch::still(base::Time now) const {
  return stands_at_ && now - stands_since_ >= milliseconds(times_.still_ms);
}

bool MotionWatch::commanded_motion(base::Time now, const Reading& reading) {
  taken_ = taken_ || proves_taken(reading) || now - began_ >= milliseconds(times_.take_ms);
  if (!taken_) return true;
  if (runs(reading)) {
    idle_since_.reset();
    return true;
  }
  if (!idle_since_) idle_since_ = now;
  const bool homing = command_ == Command::home;
  const bool finished = reading.fault || (homing ? reading.homed : reading.complete.value_or(true));
  if (!finished && now - *idle_since_ < milliseconds(times_.finish_ms)) return true;
  const bool there = !homing && std::abs(reading.position_counts - target_counts_) <= times_.tolerance_counts;
  return !there && !still(now);
}

bool MotionWatch::moving(base::Time now, const Reading& reading) {
  if (reading.fault) homed_here_ = false;
  if (!stands_at_ || std::abs(reading.position_counts - *stands_at_) > times_.tolerance_counts) {
    stands_at_ = reading.position_counts;
    stands_since_ = now;
  }
  if (command_ == Command::none) {
    // Without a bit that says "running" an old "complete" may stand for a motion that somebody else began.
    return runs(reading) && (reading.moving.has_value() || !still(now));
  }
  const bool moves =
      command_ == Command::stop ? runs(reading) || !still(now) : commanded_motion(now, reading);
  if (!moves) {
    if (command_ == Command::home) homed_here_ = !reading.fault;
    command_ = Command::none;
  }
  return moves;
}

}  // namespace rig::drivers::modbus
