// The shared object that a bench tests: opened here as rigd does it, or in a process of its own.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "drivers/conformance/bench.h"

namespace rig::drivers::conformance {

struct ModuleUnderTest {
  std::string file;                    ///< as load_module() takes it: "ptu_axis", built beside this program
  std::string settings;                ///< the text of its [module.settings]
  std::filesystem::path state_folder;  ///< exists
};

/// Loaded, its settings checked, and opened. What it logs goes to standard error. Errors: of each of these.
[[nodiscard]] base::Result<std::vector<Device>> open_module(const ModuleUnderTest& module,
                                                            base::Clock& clock);

/// The program conformance_victim, which lies beside this one: returns once the module does the task there.
/// It asks for the device's state from then on, until it is killed. Errors: what the module answered there,
/// in words; timeout; io.
[[nodiscard]] base::Result<std::unique_ptr<Victim>> start_victim(const ModuleUnderTest& module,
                                                                 const Task& task);

}  // namespace rig::drivers::conformance
