// Stepper and servo drives that speak Modbus, RTU or TCP: the driver module `modbus_axis`.
//
// Devices: any drive that keeps its own position, is given an absolute target in registers and tells in
// registers where it is. Which registers those are says the drive's description (Profile), a file; those of
// Leadshine's EM2RS and CS-RS and of Oriental Motor's AZ and CVD are in share/drives. A new drive needs a
// file, no code.
// Wiring: several drives, each with its slave number, on one RS-485 line or behind one TCP address are one
// module and share one bus. One axis is one drive.
// Example, every key, the language of the descriptions, what each fault looks like, and what was tested
// against what: docs/drivers/modbus_axis.md.
#pragma once

#include <memory>
#include <vector>

#include "drivers/api/module.h"
#include "drivers/modbus_axis/bus.h"
#include "drivers/modbus_axis/motion_watch.h"
#include "drivers/modbus_axis/reading.h"
#include "drivers/modbus_axis/settings.h"

namespace rig::drivers::modbus {

class ModbusAxis final : public Axis {
 public:
  ModbusAxis(DriveSettings settings, std::shared_ptr<Bus> bus, base::Clock& clock);

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
  /// The drive as it is now; after it was away what was known of it is forgotten first, and the registers
  /// that its description expects are compared.
  [[nodiscard]] Result<Reading> read_now();
  [[nodiscard]] Result<void> compare_expected();
  /// Reads, and refuses where the drive has an alarm or is not energised.
  [[nodiscard]] Result<Reading> ready_to_move();
  [[nodiscard]] Result<std::string> read_alarm();
  [[nodiscard]] bool is_homed(const Reading& reading) const;
  [[nodiscard]] bool stands_at(bool high, const Reading& reading) const;

  enum class Way { to_target, by_distance };
  /// From what the drive said just now.
  [[nodiscard]] Result<void> go(const Reading& before, Way way, double target_counts, double velocity_rad_s,
                                double acceleration_rad_s2);

  [[nodiscard]] Quantities fixed_quantities() const;
  [[nodiscard]] Result<void> set_up();
  [[nodiscard]] Result<void> run(const std::vector<Step>& steps, const Quantities& quantities);
  [[nodiscard]] Result<std::vector<Write>> fill_in_all(const std::vector<Step>& steps,
                                                       const Quantities& quantities) const;

  const DriveSettings settings_;
  const Profile& profile_;
  const ReadPlan plan_;
  const std::shared_ptr<Bus> bus_;
  base::Clock& clock_;
  Peer peer_;
  MotionWatch watch_;
  int known_opened_ = 0, known_lost_ = 0;
  bool compared_ = false;
  bool is_set_up_ = false;
  base::WaitSlot slot_;
};

/// Validates settings and descriptions without hardware; notes errors in the table.
void check_settings(const base::ConfigTable& settings);

[[nodiscard]] Result<std::vector<Device>> open_devices(const OpenContext& context);

}  // namespace rig::drivers::modbus
