// A module without devices, as small as they come.
#include "drivers/api/module.h"

namespace {

using rig::drivers::Device;

void check(const rig::base::ConfigTable& /*settings*/) noexcept {}

rig::base::Result<std::vector<Device>> open(const rig::drivers::OpenContext& /*context*/) noexcept {
  return std::vector<Device>();
}

constexpr rig::drivers::ModuleEntry kEntry{rig::drivers::kAbiTag, "good", &check, &open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const rig::drivers::ModuleEntry* rig_driver_module() {
  return &kEntry;
}
