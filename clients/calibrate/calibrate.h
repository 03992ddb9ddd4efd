// Registers every pose of a scan.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/registration.h"
#include "core/base/result.h"

namespace rig::calibrate {

struct CalibrateSummary {
  std::size_t planned = 0;                           ///< rows of the plan
  std::size_t taken = 0;                             ///< poses committed
  std::vector<calibration::PoseRegistration> poses;  ///< one a taken pose, by row

  [[nodiscard]] std::size_t registered() const;
  /// A few lines for a person: counts, residuals, expected error, every rejected pose with its reason.
  [[nodiscard]] std::string text() const;
};

/// Registers all committed poses on all cores and replaces SCAN/registration.toml when the last is done; an
/// interruption leaves that file as it was. A scan that cannot be read is an error; poses that cannot be
/// registered are part of the summary.
[[nodiscard]] base::Result<CalibrateSummary> calibrate_scan(const std::filesystem::path& scan,
                                                            const calibration::RegistrationLimits& limits);

}  // namespace rig::calibrate
