// The Turner's one axis.
#pragma once

#include "drivers/api/device.h"
#include "drivers/common/axis_settings.h"
#include "share/examples/driver/link.h"

namespace rig::drivers::turner {

/// Remembers nothing of the device: whatever it needs to know it asks, so that a device that lost its power
/// meanwhile is not believed to be homed.
class TurnerAxis final : public Axis {
 public:
  TurnerAxis(const AxisSettings& settings, const SerialSettings& serial, const RetryPolicy& policy,
             base::Clock& clock)
      : settings_(settings), link_(serial, policy, clock) {}

  [[nodiscard]] AxisCapabilities capabilities() const override;
  [[nodiscard]] Result<void> enable(bool on) override;
  [[nodiscard]] Result<void> home() override;
  [[nodiscard]] Result<void> move_to(double target_rad, double velocity_rad_s,
                                     double acceleration_rad_s2) override;
  [[nodiscard]] Result<void> stop() override;
  [[nodiscard]] Result<AxisState> state() override;

 private:
  [[nodiscard]] Result<void> order(std::string_view text);

  const AxisSettings settings_;
  Link link_;
};

}  // namespace rig::drivers::turner
