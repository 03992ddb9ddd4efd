// What rig.toml says about one axis, and changing that in its text.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "core/machine/lines_config.h"

namespace rig::client {

/// Numbers as they stand in the file.
struct AxisFile {
  std::string rig;  ///< its name
  std::string axis, module, device;
  double min_deg = 0, max_deg = 0, home_deg = 0, tolerance_deg = 0, approach_deg = 0;
  // Of the module's own settings, in its table axis.DEVICE; nothing where it has no such key.
  std::optional<bool> reversed;
  std::optional<double> counts_per_deg;
  machine::LimitLines limit_lines;
};

/// An Error where the text is no correct rig.toml; `name` stands for the file in messages.
[[nodiscard]] base::Result<AxisFile> read_axis_file(const std::string& text, const std::string& name,
                                                    const std::string& axis);

struct AxisChanges {
  std::optional<double> min_deg, max_deg, home_deg;
  std::optional<bool> reversed;
  std::optional<double> counts_per_deg;
};

/// The text with these values in place of the old ones, comments and order kept. It may not be a correct
/// rig.toml: read_axis_file tells.
[[nodiscard]] base::Result<std::string> with_changes(const std::string& text, const AxisFile& file,
                                                     const AxisChanges& changes);

/// Writes `text` to `path` durably, with the owner and permissions it had, and hands back where the old file
/// is kept: beside it, as NAME.bak-<date-time>. An Error, and nothing done, where the file no longer holds
/// `read`.
[[nodiscard]] base::Result<std::filesystem::path> replace_keeping_old(const std::filesystem::path& path,
                                                                      const std::string& read,
                                                                      const std::string& text);

}  // namespace rig::client
