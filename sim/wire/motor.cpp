#include "sim/wire/motor.h"

#include <algorithm>
#include <cmath>

namespace rig::sim::wire {

namespace {

// Steps of this length are exact to far below a count at any speed of a real drive.
constexpr double kStep_s = 1e-4;

double towards(double from, double to, double most) {
  return from + std::clamp(to - from, -most, most);
}

}  // namespace

void Motor::move_to(Time now, double target, double velocity, double acceleration) {
  advance(now);
  target_ = std::clamp(target, limits_.low, limits_.high);
  cruise_ = std::abs(velocity);
  acceleration_ = std::abs(acceleration);
  mode_ = Mode::move;
}

void Motor::run(Time now, double velocity, double acceleration) {
  advance(now);
  cruise_ = velocity;
  acceleration_ = std::abs(acceleration);
  mode_ = Mode::run;
}

void Motor::stop(Time now, double deceleration) {
  advance(now);
  acceleration_ = std::abs(deceleration);
  if (mode_ != Mode::rest) mode_ = Mode::stop;
}

void Motor::put(Time now, double position) {
  advance(now);
  position_ = target_ = std::clamp(position, limits_.low, limits_.high);
  speed_ = 0;
  mode_ = Mode::rest;
}

double Motor::position(Time now) {
  advance(now);
  return position_;
}

double Motor::velocity(Time now) {
  advance(now);
  return speed_;
}

bool Motor::moving(Time now) {
  advance(now);
  return mode_ != Mode::rest;
}

void Motor::advance(Time now) {
  if (!at_) {
    at_ = now;
    if (mode_ == Mode::rest) target_ = position_;
  }
  double left = std::chrono::duration<double>(now - *at_).count();
  at_ = std::max(now, *at_);
  while (left > 0 && mode_ != Mode::rest) {
    const double dt = std::min(left, kStep_s);
    left -= dt;
    const double change = acceleration_ * dt;
    double wanted = 0;
    if (mode_ == Mode::run) wanted = cruise_;
    if (mode_ == Mode::move) {
      const double way = target_ - position_;
      constexpr double kThere = 1e-6;
      if (std::abs(way) <= kThere && std::abs(speed_) <= 2 * change) {
        position_ = target_;
        speed_ = 0;
        mode_ = Mode::rest;
        break;
      }
      // The fastest from which it can still stop at the target after this step: v dt + v^2 / 2a = way.
      const double a = acceleration_;
      const double most = a * (std::sqrt(dt * dt + 2 * std::abs(way) / a) - dt);
      wanted = std::copysign(std::min(cruise_, most), way);
    }
    speed_ = towards(speed_, wanted, change);
    position_ += speed_ * dt;
    if (mode_ == Mode::stop && speed_ == 0) mode_ = Mode::rest;
    if (position_ < limits_.low || position_ > limits_.high) {
      position_ = std::clamp(position_, limits_.low, limits_.high);
      speed_ = 0;
      mode_ = Mode::rest;
    }
  }
  if (mode_ == Mode::rest) target_ = position_;
}

}  // namespace rig::sim::wire
