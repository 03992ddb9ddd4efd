// The devices of rig.toml, opened, each with the worker of its bus.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/base/result.h"
#include "core/machine/rig_config.h"
#include "daemon/bus_worker.h"
#include "daemon/state.h"
#include "drivers/api/device.h"

namespace rig::daemon {

/// Validates every module's settings without hardware.
[[nodiscard]] base::Result<void> check_modules(const machine::RigConfig& rig);

/// A device of lines that rig.toml names, and which of its lines play a part.
struct LinesDevice {
  std::string name;  ///< machine::lines_name()
  drivers::DigitalIo* io = nullptr;
  BusWorker* worker = nullptr;
  std::size_t offered = 0;  ///< how many lines a reading has
  // Their places in a reading.
  std::optional<std::size_t> emergency_stop;
  std::array<std::array<std::optional<std::size_t>, kEnds>, kAxisCount> limits;
  bool has_limits = false;
};

struct OpenDevices {
  std::vector<drivers::Device> devices;                       ///< owns them; outlives the workers
  std::map<std::string, std::unique_ptr<BusWorker>> workers;  ///< by "module/bus"
  std::array<drivers::Axis*, kAxisCount> axes{};
  std::array<BusWorker*, kAxisCount> axis_workers{};
  drivers::Camera* camera = nullptr;
  BusWorker* camera_worker = nullptr;
  drivers::Light* light = nullptr;
  BusWorker* light_worker = nullptr;
  std::vector<LinesDevice> lines;
  /// Index of the one that has the line that triggers the camera; nothing: its own command does.
  std::optional<std::size_t> trigger;

  /// Carries out what is queued at every bus, and ends the workers.
  void finish() { workers.clear(); }
};

/// Loads one module and opens it; its files are in its own folder below `state_folder`.
[[nodiscard]] base::Result<std::vector<drivers::Device>> open_module(
    const machine::ModuleConfig& module, base::Clock& clock, const std::filesystem::path& state_folder);

/// Loads the modules, opens them and finds the devices that rig.toml names. What the hardware cannot do that
/// rig.toml claims is an error.
[[nodiscard]] base::Result<std::unique_ptr<OpenDevices>> open_devices(
    const machine::RigConfig& rig, base::Clock& clock, const std::filesystem::path& state_folder);

}  // namespace rig::daemon
