#include "drivers/conformance/module_under_test.h"

#include <cstdio>

#include "drivers/host/module_loader.h"

namespace rig::drivers::conformance {

namespace {

void to_standard_error(base::LogLevel /*level*/, std::string_view message) {
  std::fprintf(stderr, "%.*s\n", static_cast<int>(message.size()), message.data());
}

}  // namespace

Result<std::vector<Device>> open_module(const ModuleUnderTest& module, base::Clock& clock) {
  const auto entry = load_module(module.file, module_search_path());
  if (!entry) return base::pass(entry);
  const auto settings = base::ConfigTable::parse(module.settings, "rig.toml");
  if (!settings) return base::pass(settings);
  (*entry)->check(*settings);
  if (auto fine = settings->finish(); !fine) return base::pass(fine);
  return (*entry)->open({"bench", *settings, module.state_folder, clock, &to_standard_error});
}

}  // namespace rig::drivers::conformance
