// The one door of a driver module: a shared object that exports `rig_driver_module`. It is loaded at the
// start of rigd and never unloaded. No exception crosses it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/base/config.h"
#include "core/base/log.h"
#include "core/base/result.h"
#include "drivers/api/device.h"

#define RIG_DRIVER_STRINGIFY_(x) #x
#define RIG_DRIVER_STRINGIFY(x) RIG_DRIVER_STRINGIFY_(x)
#if defined(__SANITIZE_ADDRESS__)
#define RIG_DRIVER_SANITIZER "address"
#elif defined(__SANITIZE_THREAD__)
#define RIG_DRIVER_SANITIZER "thread"
#else
#define RIG_DRIVER_SANITIZER "none"
#endif

namespace rig::drivers {

/// Raised when anything that crosses the door changes shape.
#define RIG_DRIVER_ABI_VERSION 5

/// Host and module must agree on it letter by letter: interface, compiler and sanitizer.
inline constexpr const char* kAbiTag = "rig-driver-" RIG_DRIVER_STRINGIFY(
    RIG_DRIVER_ABI_VERSION) " gcc-" RIG_DRIVER_STRINGIFY(__GNUC__) " " RIG_DRIVER_SANITIZER;

/// What a module is opened with.
struct OpenContext {
  std::string instance;                ///< name of the [[module]] in rig.toml
  const base::ConfigTable& settings;   ///< its [module.settings]; its errors name file, line and key
  std::filesystem::path state_folder;  ///< exists; the module may keep files there between runs
  base::Clock& clock;                  ///< outlives the module's devices
  void (*log)(base::LogLevel, std::string_view);
};

struct ModuleEntry {
  const char* abi_tag;  ///< kAbiTag
  const char* name;     ///< "virtual"
  /// Validates settings without hardware; notes its errors in `settings`.
  void (*check)(const base::ConfigTable& settings) noexcept;
  /// Opens the hardware and offers its devices.
  base::Result<std::vector<Device>> (*open)(const OpenContext& context) noexcept;
};

/// Name and type of the exported function.
inline constexpr const char* kEntrySymbol = "rig_driver_module";
using EntryFunction = const ModuleEntry* (*)();

}  // namespace rig::drivers
