// The rig's safe state without rigd: after rigd died, nothing else holds the devices.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "core/machine/rig_config.h"

namespace rig::daemon {

/// What became of one part of the rig: "axis roll: stands at 12.0031 deg". An empty state: there is nothing
/// to tell.
struct SafePart {
  std::string name;
  base::Result<std::string> state;
};

/// A piece of work on its own thread: `parts` are the names of what it answers for, each once, through
/// `tell`.
struct SafeWork {
  std::vector<std::string> parts;
  std::function<void(const std::function<void(SafePart)>& tell)> run;
};

/// Does all of it at the same time and returns when every part was told of, or after `within`: what was not
/// told by then is an error of that part; one of which there is nothing to tell is left out. A thread that
/// hangs in a driver is left behind; the process should end soon.
[[nodiscard]] std::vector<SafePart> work_within(std::vector<SafeWork> works,
                                                std::chrono::milliseconds within);

/// Stops every axis of rig.toml, then makes its light safe (shutter closed; level 0 where it has none),
/// brings the output lines of every module to their state of rest (drivers::Line::at_rest), and waits until
/// the axes stand. Each module is opened by itself, so that one that cannot be opened keeps no other from its
/// safe state.
[[nodiscard]] std::vector<SafePart> make_safe(const std::shared_ptr<const machine::RigConfig>& rig,
                                              const std::shared_ptr<base::Clock>& clock,
                                              const std::filesystem::path& state_folder,
                                              std::chrono::milliseconds within);

}  // namespace rig::daemon
