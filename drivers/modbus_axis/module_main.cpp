// The door of the driver module for drives that speak Modbus.
#include <exception>

#include "drivers/modbus_axis/modbus_axis.h"

namespace {

void check(const rig::base::ConfigTable& settings) noexcept {
  rig::drivers::modbus::check_settings(settings);
}

rig::base::Result<std::vector<rig::drivers::Device>> open(const rig::drivers::OpenContext& context) noexcept {
  try {
    return rig::drivers::modbus::open_devices(context);
  } catch (const std::exception& error) {
    return rig::base::fail(rig::base::ErrorCode::device, error.what(), context.instance);
  }
}

constexpr rig::drivers::ModuleEntry kEntry{rig::drivers::kAbiTag, "modbus_axis", &check, &open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const rig::drivers::ModuleEntry* rig_driver_module() {
  return &kEntry;
}
