// A drive at the end of the fake wire.
#pragma once

#include "sim/wire/motor.h"
#include "tests/drivers/conformance/fake_wire.h"

namespace rig::drivers::conformance {

inline constexpr int kAxisRead = 100, kAxisEnable = 101, kAxisHome = 102, kAxisMove = 103, kAxisStop = 104;

/// Answers of kAxisRead: position, moving, homed, enabled, fault, low limit, high limit. Of the others:
/// whether it was taken.
class FakeDrive final : public AxisPeer {
 public:
  static constexpr std::size_t kReadValues = 7;
  static constexpr double kStep_rad = 1e-4;

  FakeDrive(base::Clock& clock, Flaw flaw) : clock_(clock), flaw_(flaw) {}

  [[nodiscard]] double position_rad() override { return motor_.position(now()) * kStep_rad; }
  [[nodiscard]] bool moving() override { return motor_.moving(now()); }
  [[nodiscard]] int stops_seen() override { return stops_; }
  bool set_limit(bool high, bool active) override;
  bool set_fault(bool on) override;
  bool forget_reference() override;

  void power_up();
  [[nodiscard]] Words answer(const Words& request);

 private:
  [[nodiscard]] sim::wire::Motor::Time now() const;
  void settle();
  [[nodiscard]] bool may_move(double target);
  bool take(const Words& request);

  static constexpr double kHome = 0, kFar = 20000, kBrake = 40000;
  base::Clock& clock_;
  const Flaw flaw_;
  sim::wire::Motor motor_{1500, {-kFar, kFar}};
  double offset_ = 0;  // what it reads too little since it was powered up
  bool enabled_ = false, homed_ = false, homing_ = false;
  bool fault_cause_ = false, fault_ = false;
  bool low_ = false, high_ = false;
  int stops_ = 0;
};

}  // namespace rig::drivers::conformance
