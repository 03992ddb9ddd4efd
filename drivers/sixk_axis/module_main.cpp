// The door of the driver of 6000 controllers.
#include <exception>

#include "drivers/sixk_axis/devices.h"

namespace {

void check(const rig::base::ConfigTable& settings) noexcept {
  try {
    rig::drivers::sixk::check_settings(settings);
  } catch (const std::exception& error) {
    settings.error("", error.what());
  }
}

rig::base::Result<std::vector<rig::drivers::Device>> open(const rig::drivers::OpenContext& context) noexcept {
  try {
    return rig::drivers::sixk::open_devices(context);
  } catch (const std::exception& error) {
    return rig::base::fail(rig::base::ErrorCode::device, error.what(), context.instance);
  }
}

constexpr rig::drivers::ModuleEntry kEntry{rig::drivers::kAbiTag, "sixk_axis", &check, &open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const rig::drivers::ModuleEntry* rig_driver_module() {
  return &kEntry;
}
