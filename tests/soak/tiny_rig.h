// The shipped virtual rig with frames of 160 x 120 painted from a hash.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "core/base/result.h"

namespace rig::soak {

/// `text` with each first string, wherever it stands, replaced by its second; an Error where it stands
/// nowhere.
inline base::Result<std::string> changed(std::string text,
                                         const std::vector<std::pair<std::string, std::string>>& changes) {
  for (const auto& [from, to] : changes) {
    std::size_t at = text.find(from);
    if (at == std::string::npos)
      return base::fail(base::ErrorCode::bad_input, "has no '" + from + "' to be changed");
    for (; at != std::string::npos; at = text.find(from, at + to.size())) text.replace(at, from.size(), to);
  }
  return text;
}

/// The text of `shipped` (share/virtual/rig.toml) changed so. `faults` is what stands below
/// [module.settings.faults]; empty: no such table.
inline base::Result<std::string> tiny_rig(const std::filesystem::path& shipped, const std::string& faults) {
  auto text = base::read_file(shipped);
  if (!text) return text;
  std::string render = "readout_ms = 500.0\nrender = \"hash\"";
  if (!faults.empty()) render += "\n\n[module.settings.faults]\n" + faults;
  return changed(std::move(*text), {{"width = 1600", "width = 160"},
                                    {"height = 1200", "height = 120"},
                                    {"fx_px = 6000.0", "fx_px = 600.0"},
                                    {"fy_px = 6000.0", "fy_px = 600.0"},
                                    {"cx_px = 803.2", "cx_px = 80.3"},
                                    {"cy_px = 596.4", "cy_px = 59.6"},
                                    {"readout_ms = 500.0", render}});
}

}  // namespace rig::soak
