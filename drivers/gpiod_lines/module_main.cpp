// The door of the module gpiod_lines.
#include <exception>

#include "drivers/gpiod_lines/devices.h"

namespace {

void check(const rig::base::ConfigTable& settings) noexcept {
  rig::drivers::gpiod_lines::check_settings(settings);
}

rig::base::Result<std::vector<rig::drivers::Device>> open(const rig::drivers::OpenContext& context) noexcept {
  try {
    return rig::drivers::gpiod_lines::open_devices(context);
  } catch (const std::exception& error) {
    return rig::base::fail(rig::base::ErrorCode::device, error.what(), context.instance);
  }
}

constexpr rig::drivers::ModuleEntry kEntry{rig::drivers::kAbiTag, "gpiod_lines", &check, &open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const rig::drivers::ModuleEntry* rig_driver_module() {
  return &kEntry;
}
