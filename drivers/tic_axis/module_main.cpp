// The door of the driver module for Pololu Tics.
#include <exception>

#include "drivers/tic_axis/devices.h"

namespace {

void check(const rig::base::ConfigTable& settings) noexcept {
  rig::drivers::tic::check_settings(settings);
}

rig::base::Result<std::vector<rig::drivers::Device>> open(const rig::drivers::OpenContext& context) noexcept {
  try {
    return rig::drivers::tic::open_devices(context);
  } catch (const std::exception& error) {
    return rig::base::fail(rig::base::ErrorCode::device, error.what(), context.instance);
  }
}

constexpr rig::drivers::ModuleEntry kEntry{rig::drivers::kAbiTag, "tic_axis", &check, &open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const rig::drivers::ModuleEntry* rig_driver_module() {
  return &kEntry;
}
