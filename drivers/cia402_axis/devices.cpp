#include "drivers/cia402_axis/devices.h"

#include "drivers/cia402_axis/axis.h"

namespace rig::drivers::cia402 {

void check_settings(const base::ConfigTable& settings) {
  (void)read_settings(settings);
}

base::Result<std::vector<Device>> open_devices(const OpenContext& context) {
  const Settings settings = read_settings(context.settings);
  if (auto fine = context.settings.noted(); !fine) return base::pass(fine);
  const Network::Log log = [to = context.log, instance = context.instance](base::LogLevel level,
                                                                           const std::string& what) {
    if (to != nullptr) to(level, fmt::format("{}: {}", instance, what));
  };
  std::vector<int> nodes;
  nodes.reserve(settings.drives.size());
  for (const DriveSettings& drive : settings.drives) nodes.push_back(drive.node);
  const auto network = std::make_shared<Network>(settings.network, nodes, context.clock, log);
  // What is wrong with the interface is said at once, and not for the first time when an axis is called.
  if (auto heard = network->listen(); !heard) log(base::LogLevel::warning, heard.error().text());
  std::vector<Device> devices;
  devices.reserve(settings.drives.size());
  for (const DriveSettings& drive : settings.drives) {
    devices.push_back({drive.axis.name, settings.network.interface,
                       std::make_unique<Cia402Axis>(network, drive, context.clock, log)});
  }
  return devices;
}

}  // namespace rig::drivers::cia402
