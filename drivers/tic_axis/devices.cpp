#include "drivers/tic_axis/devices.h"

#include "drivers/tic_axis/axis.h"

namespace rig::drivers::tic {

void check_settings(const base::ConfigTable& settings) {
  (void)read_module_settings(settings);
}

base::Result<std::vector<Device>> open_devices(const OpenContext& context) {
  const ModuleSettings module = read_module_settings(context.settings);
  if (auto fine = context.settings.noted(); !fine) return base::pass(fine);
  std::vector<Device> devices;
  for (const TicSettings& tic : module.tics) {
    auto axis = std::make_unique<TicAxis>(
        tic, module, context.clock,
        [log = context.log](base::LogLevel level, const std::string& text) { log(level, text); });
    devices.push_back({tic.axis.name, tic.axis.name, std::move(axis)});
  }
  return devices;
}

}  // namespace rig::drivers::tic
