// The door of the driver module for CANopen drives.
#include <exception>

#include "drivers/cia402_axis/devices.h"

namespace {

void check(const rig::base::ConfigTable& settings) noexcept {
  rig::drivers::cia402::check_settings(settings);
}

rig::base::Result<std::vector<rig::drivers::Device>> open(const rig::drivers::OpenContext& context) noexcept {
  try {
    return rig::drivers::cia402::open_devices(context);
  } catch (const std::exception& error) {
    return rig::base::fail(rig::base::ErrorCode::device, error.what(), context.instance);
  }
}

constexpr rig::drivers::ModuleEntry kEntry{rig::drivers::kAbiTag, "cia402_axis", &check, &open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const rig::drivers::ModuleEntry* rig_driver_module() {
  return &kEntry;
}
