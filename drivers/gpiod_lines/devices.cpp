#include "drivers/gpiod_lines/devices.h"

#include "drivers/common/relay_light.h"
#include "drivers/gpiod_lines/lines.h"
#include "drivers/gpiod_lines/settings.h"

namespace rig::drivers::gpiod_lines {

using base::pass;
using base::Result;

namespace {

constexpr const char* kBus = "lines";
constexpr const char* kHoursFile = "light.hours";

}  // namespace

void check_settings(const base::ConfigTable& settings) {
  (void)read_lines_settings(settings);
}

Result<std::vector<Device>> open_devices(const OpenContext& context) {
  const LinesSettings settings = read_lines_settings(context.settings);
  if (auto fine = context.settings.noted(); !fine) return pass(fine);
  auto lines = open_lines(settings, context.clock, context.log);
  if (!lines) return pass(lines);
  std::vector<Device> devices;
  devices.push_back({"lines", kBus, make_reader(*lines)});
  if (settings.light) {
    auto light = make_relay_light(*settings.light, make_reader(*lines), context.state_folder / kHoursFile,
                                  context.clock, context.log);
    if (!light) return pass(light);
    devices.push_back({"light", kBus, std::move(*light)});
  }
  return devices;
}

}  // namespace rig::drivers::gpiod_lines
