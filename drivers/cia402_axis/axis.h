// The driver for CANopen drives of CiA 402, over SocketCAN (docs/drivers/cia402_axis.md).
//
// A call of an axis asks and orders object by object (drive.h, power.h) over a bus that all axes of one
// interface share (network.h); the CiA 301 and 402 encodings are pure (sdo.h, node_monitor.h, statusword.h,
// emergency.h). Nothing here waits for a motion. What the driver waits for, within the bound of one call, is
// that the drive goes on by a state, shows a mode, or takes a set-point: each is a milliseconds' matter.
#pragma once

#include "drivers/api/device.h"
#include "drivers/cia402_axis/power.h"
#include "drivers/cia402_axis/standstill.h"

namespace rig::drivers::cia402 {

class Cia402Axis final : public Axis {
 public:
  Cia402Axis(std::shared_ptr<Network> network, const DriveSettings& settings, base::Clock& clock,
             Network::Log log);

  [[nodiscard]] AxisCapabilities capabilities() const override;
  [[nodiscard]] Result<void> enable(bool on) override;
  [[nodiscard]] Result<void> home() override;
  [[nodiscard]] Result<void> move_to(double target_rad, double velocity_rad_s,
                                     double acceleration_rad_s2) override;
  [[nodiscard]] Result<void> move_by(double delta_rad, double velocity_rad_s,
                                     double acceleration_rad_s2) override;
  [[nodiscard]] Result<void> stop() override;
  [[nodiscard]] Result<AxisState> state() override;

 private:
  enum class Doing { nothing, moving, homing };
  enum class Homed { unknown, no, yes };

  /// What one look at the drive has shown.
  struct Look {
    std::uint16_t statusword = 0;
    Power power = Power::not_ready;
    std::int32_t position = 0;
    bool at_low = false, at_high = false;
    std::uint16_t error_code = 0;  ///< in a fault
    [[nodiscard]] bool has(std::uint16_t bit) const { return (statusword & bit) != 0; }
  };

  [[nodiscard]] Deadline deadline() const { return Steady::now() + drive_.call_bound(); }
  [[nodiscard]] Result<void> reach(Deadline deadline);
  /// Reaches the drive and looks at it; anew where it booted meanwhile.
  [[nodiscard]] Result<Look> reach_and_look(Deadline deadline);
  [[nodiscard]] Result<Look> look(Deadline deadline);

  [[nodiscard]] Result<void> switch_on(Deadline deadline);
  [[nodiscard]] Result<void> switch_off(Deadline deadline);
  [[nodiscard]] Result<void> start_homing(Deadline deadline);
  [[nodiscard]] Result<void> start_move(std::int32_t target, double velocity, double acceleration,
                                        Deadline deadline);
  [[nodiscard]] Result<void> start_jog(double delta_rad, double velocity, double acceleration,
                                       Deadline deadline);
  [[nodiscard]] Result<void> check_rates(double velocity, double acceleration) const;
  /// What the drive shows, where it is not being homed.
  [[nodiscard]] Result<Look> look_before_move(Deadline deadline);
  [[nodiscard]] Result<void> set_off(std::int32_t target, double velocity, double acceleration,
                                     Deadline deadline);
  [[nodiscard]] Result<AxisState> look_at_it(Deadline deadline);

  [[nodiscard]] Result<std::uint32_t> velocity_units(double rad_s) const;
  [[nodiscard]] Result<std::uint32_t> acceleration_units(double rad_s2) const;

  [[nodiscard]] bool is_moving(const Look& look) const;
  [[nodiscard]] bool is_homed(const Look& look) const;
  [[nodiscard]] std::string fault_of(const Look& look);
  [[nodiscard]] Result<void> follow_homing(const Look& look, Deadline deadline);
  [[nodiscard]] Result<void> ask_whether_homed(const Look& look, Deadline deadline);
  /// A homing that did not come to its end.
  void break_off_homing();

  const DriveSettings settings_;
  base::Clock& clock_;
  Drive drive_;

  // Beliefs, void whenever the drive is met anew.
  int acquaintance_ = 0;
  Doing doing_ = Doing::nothing;
  base::Time began_{};  ///< what it is doing
  Homed homed_ = Homed::no;
  bool ask_when_on_ = false;  ///< whether it was homed: it did not tell without power
  bool homing_failed_ = false;
  Standstill standstill_;
};

}  // namespace rig::drivers::cia402
