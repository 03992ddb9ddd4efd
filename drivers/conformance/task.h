// What a module is doing when its process is killed.
#pragma once

#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "drivers/api/device.h"

namespace rig::drivers::conformance {

/// Energised and homed, from rest at `from_rad`.
struct MoveTask {
  double from_rad = 0, to_rad = 0;
  double velocity_rad_s = 0, acceleration_rad_s2 = 0;
};
struct ExposeTask {
  double exposure_s = 0, gain = 1;
};
/// With its shutter open, where it has one.
struct ShineTask {
  double level = 0;
};
struct SetLineTask {
  std::string line;  ///< empty: only looked at
  bool active = false;
};

struct Task {
  std::string device;
  std::variant<MoveTask, ExposeTask, ShineTask, SetLineTask> what;
};

/// Does on the module's devices what is needed before, and starts it: returns once it is under way. Errors:
/// the device's; not_found; timeout.
[[nodiscard]] base::Result<void> start(const Task& task, std::vector<Device>& devices, base::Clock& clock);
/// Asks the device for its state once, as rigd does again and again; what it answers does not matter here.
void look_at(const Task& task, std::vector<Device>& devices);

/// As arguments of a program, and back. Errors: bad_input.
[[nodiscard]] std::vector<std::string> words_of(const Task& task);
[[nodiscard]] base::Result<Task> task_of(std::span<const std::string> words);

}  // namespace rig::drivers::conformance
