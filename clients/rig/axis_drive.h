// Moving one axis through rigd while a person stands beside it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/rig/commands.h"
#include "clients/rig/dialogue.h"
#include "protocol/rig.pb.h"

namespace rig::client {

/// An interrupt during a movement stops the rig.
class AxisDrive {
 public:
  /// Says through `dialogue`, which must outlive this, what it does.
  AxisDrive(Connection to, std::string axis, double tolerance_deg, const Dialogue& dialogue);

  [[nodiscard]] Result<protocol::AxisStatus> look();
  [[nodiscard]] Result<double> position();
  // As they were at the last look.
  [[nodiscard]] const std::string& rig_name() const { return rig_.rig_name(); }
  [[nodiscard]] std::vector<std::string> not_homed() const;

  [[nodiscard]] Result<void> home() const;
  [[nodiscard]] Result<void> home_all() const;
  /// Where it stands afterwards; it stays where it is there already. What rigd refuses is told to the person,
  /// and nothing handed back.
  [[nodiscard]] Result<std::optional<double>> go_to(double angle_deg);

  /// By so much from where it stands, before it is homed. False where rigd refused it, which is told to the
  /// person.
  [[nodiscard]] Result<bool> jog(double by_deg) const;

 private:
  const Connection to_;
  const std::string axis_;
  const double tolerance_deg_;
  const Dialogue* dialogue_;
  protocol::Status rig_;
};

}  // namespace rig::client
