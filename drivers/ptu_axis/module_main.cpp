// The door of the driver of pan-tilt units.
#include <exception>

#include "drivers/ptu_axis/devices.h"

namespace {

void check(const rig::base::ConfigTable& settings) noexcept {
  try {
    rig::drivers::ptu::check_settings(settings);
  } catch (const std::exception& error) {
    settings.error("", error.what());
  }
}

rig::base::Result<std::vector<rig::drivers::Device>> open(const rig::drivers::OpenContext& context) noexcept {
  try {
    return rig::drivers::ptu::open_devices(context);
  } catch (const std::exception& error) {
    return rig::base::fail(rig::base::ErrorCode::device, error.what(), context.instance);
  }
}

constexpr rig::drivers::ModuleEntry kEntry{rig::drivers::kAbiTag, "ptu_axis", &check, &open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const rig::drivers::ModuleEntry* rig_driver_module() {
  return &kEntry;
}
