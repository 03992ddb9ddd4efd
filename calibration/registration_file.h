// SCAN/registration.toml: what became of every pose (docs/file-formats.md).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/registration.h"
#include "core/base/result.h"

namespace rig::calibration {

/// Version of the file; a reader refuses greater ones.
inline constexpr int kRegistrationFormat = 1;

struct RegistrationFile {
  std::string rig_sha256;               ///< of the scan's rig.toml as it was used: another rig, other poses
  std::vector<PoseRegistration> poses;  ///< by row
};

/// Where a scan keeps it.
[[nodiscard]] std::filesystem::path registration_path(const std::filesystem::path& scan);

[[nodiscard]] std::string format_registration(const RegistrationFile& file);
/// Reads back what format_registration wrote, to the last bit; errors name line, column and key.
[[nodiscard]] base::Result<RegistrationFile> parse_registration(std::string_view text,
                                                                const std::string& name);

/// Replaces the scan's file, whole or not at all.
[[nodiscard]] base::Result<void> write_registration(const std::filesystem::path& scan,
                                                    const RegistrationFile& file);
/// A missing file is an error that says how to make it; a file made with another rig.toml than the scan holds
/// now is one too.
[[nodiscard]] base::Result<RegistrationFile> read_registration(const std::filesystem::path& scan);

}  // namespace rig::calibration
