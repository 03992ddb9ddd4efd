// Loading driver modules.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "drivers/api/module.h"

namespace rig::drivers {

/// The entry of a module: `file` is a path (with a slash) or a name, which is looked for as
/// librig_driver_<file>.so in `search`, in order. A missing symbol, a foreign ABI tag and an exception are
/// errors that name the file.
[[nodiscard]] base::Result<const ModuleEntry*> load_module(const std::string& file,
                                                           const std::vector<std::filesystem::path>& search);

/// Where modules are looked for: $RIG_DRIVER_PATH (folders separated by colons), then ../lib and ../lib/rigd
/// beside the running program.
[[nodiscard]] std::vector<std::filesystem::path> module_search_path();

}  // namespace rig::drivers
