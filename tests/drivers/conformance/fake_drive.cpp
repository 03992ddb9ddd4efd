#include "tests/drivers/conformance/fake_drive.h"

namespace rig::drivers::conformance {

sim::wire::Motor::Time FakeDrive::now() const {
  return sim::wire::Motor::Time(clock_.now().time_since_epoch());
}

bool FakeDrive::set_limit(bool high, bool active) {
  settle();
  (high ? high_ : low_) = active;
  if (active && moving() && (motor_.velocity(now()) > 0) == high) motor_.put(now(), motor_.position(now()));
  return true;
}

bool FakeDrive::set_fault(bool on) {
  settle();
  fault_cause_ = on;
  if (on) {
    fault_ = true;
    enabled_ = homing_ = false;
    motor_.stop(now(), kBrake);
  }
  return true;
}

bool FakeDrive::forget_reference() {
  power_up();
  return true;
}

void FakeDrive::power_up() {
  motor_.put(now(), motor_.position(now()));
  offset_ = motor_.position(now());
  enabled_ = homed_ = homing_ = fault_ = false;
}

void FakeDrive::settle() {
  if (!homing_ || moving()) return;
  homing_ = false;
  homed_ = true;
  offset_ = 0;
}

bool FakeDrive::may_move(double target) {
  if (!enabled_ || homing_) return false;
  if (flaw_ == Flaw::goes_into_limit) return true;
  const double here = motor_.position(now());
  return !(high_ && target > here) && !(low_ && target < here);
}

bool FakeDrive::take(const Words& request) {
  switch (static_cast<int>(request.front())) {
    case kAxisEnable:
      enabled_ = request[1] != 0;
      if (!enabled_) {
        motor_.stop(now(), kBrake);
        homing_ = false;
      }
      if (enabled_ && !fault_cause_) fault_ = false;
      if (fault_) enabled_ = false;
      return true;
    case kAxisHome:
      if (!enabled_) return false;
      homed_ = false;
      homing_ = true;
      motor_.move_to(now(), kHome, 4000, kBrake);
      return true;
    case kAxisMove:
      if (!may_move(request[1] + offset_)) return false;
      motor_.move_to(now(), request[1] + offset_, request[2], request[3]);
      return true;
    case kAxisStop:
      ++stops_;
      homing_ = false;
      motor_.stop(now(), kBrake);
      return true;
    default:
      return false;
  }
}

Words FakeDrive::answer(const Words& request) {
  settle();
  if (request.front() != kAxisRead) return {request.front(), take(request) ? 1.0 : 0.0};
  const auto bit = [](bool on) { return on ? 1.0 : 0.0; };
  return {request.front(), motor_.position(now()) - offset_,
          bit(moving()),   bit(homed_),
          bit(enabled_),   bit(fault_),
          bit(low_),       bit(high_)};
}

}  // namespace rig::drivers::conformance
