// A module that is wrong in the one way that BREAK names.
#include <stdexcept>

#include "drivers/api/module.h"

#define FOREIGN_TAG 1
#define LONGER_TAG 2
#define NULL_TAG 3
#define NULL_ENTRY 4
#define NULL_OPEN 5
#define NULL_NAME 6
#define THROWS 7
#define THROWS_A_NUMBER 8
#define NO_DOOR 9
#define UNRESOLVED 10

namespace {

using rig::drivers::Device;
using rig::drivers::ModuleEntry;

void check(const rig::base::ConfigTable& /*settings*/) noexcept {}

rig::base::Result<std::vector<Device>> open(const rig::drivers::OpenContext& /*context*/) noexcept {
  return std::vector<Device>();
}

[[maybe_unused]] ModuleEntry entry{rig::drivers::kAbiTag, "broken", &check, &open};

}  // namespace

#if BREAK == UNRESOLVED
extern "C" const ModuleEntry* rig_driver_test_defined_nowhere();
#endif

#if BREAK == NO_DOOR
extern "C" __attribute__((visibility("default"))) const ModuleEntry* some_other_function() {
#else
extern "C" __attribute__((visibility("default"))) const ModuleEntry* rig_driver_module() {
#endif
#if BREAK == FOREIGN_TAG
  entry.abi_tag = "rig-driver-0 gcc-2 none";
#elif BREAK == LONGER_TAG
  static const std::string tag = std::string(rig::drivers::kAbiTag) + " and more";
  entry.abi_tag = tag.c_str();
#elif BREAK == NULL_TAG
entry.abi_tag = nullptr;
#elif BREAK == NULL_ENTRY
return nullptr;
#elif BREAK == NULL_OPEN
entry.open = nullptr;
#elif BREAK == NULL_NAME
entry.name = nullptr;
#elif BREAK == THROWS
throw std::runtime_error("the hardware is not in the mood");
#elif BREAK == THROWS_A_NUMBER
throw 7;
#elif BREAK == UNRESOLVED
return rig_driver_test_defined_nowhere();
#endif
  return &entry;
}
