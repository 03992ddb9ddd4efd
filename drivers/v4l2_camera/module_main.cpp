// The door of the module for cameras on Video4Linux.
#include <exception>

#include "drivers/v4l2_camera/devices.h"

namespace {

void check(const rig::base::ConfigTable& settings) noexcept {
  rig::drivers::v4l2::check_settings(settings);
}

rig::base::Result<std::vector<rig::drivers::Device>> open(const rig::drivers::OpenContext& context) noexcept {
  try {
    return rig::drivers::v4l2::open_devices(context);
  } catch (const std::exception& error) {
    return rig::base::fail(rig::base::ErrorCode::device, error.what(), context.instance);
  }
}

constexpr rig::drivers::ModuleEntry kEntry{rig::drivers::kAbiTag, "v4l2_camera", &check, &open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const rig::drivers::ModuleEntry* rig_driver_module() {
  return &kEntry;
}
