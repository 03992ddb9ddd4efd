// rigd put together from its parts.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/result.h"

namespace rig::daemon {

struct Options {
  std::string config;  ///< rig.toml
  std::filesystem::path state_folder;
  std::filesystem::path runtime_folder;
  double statistics_s = 60;  ///< between two Stats lines, of the wall; 0: none
};

/// Validates rig.toml and the settings of its modules, without touching hardware.
[[nodiscard]] base::Result<void> check(const Options& options);

/// Runs until SIGINT or SIGTERM.
[[nodiscard]] base::Result<void> run(const Options& options);

}  // namespace rig::daemon
