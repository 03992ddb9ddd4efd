#include "drivers/dmx_light/devices.h"

#include "drivers/dmx_light/dmx_light.h"
#include "drivers/dmx_light/settings.h"

namespace rig::drivers::dmx_light {

using base::pass;
using base::Result;

void check_settings(const base::ConfigTable& settings) {
  (void)read_dmx_settings(settings);
}

Result<std::vector<Device>> open_devices(const OpenContext& context) {
  const DmxSettings settings = read_dmx_settings(context.settings);
  if (auto fine = context.settings.noted(); !fine) return pass(fine);
  auto light = make_dmx_light(settings, context);
  if (!light) return pass(light);
  std::vector<Device> devices;
  devices.push_back({"light", "light", std::move(*light)});
  return devices;
}

}  // namespace rig::drivers::dmx_light
