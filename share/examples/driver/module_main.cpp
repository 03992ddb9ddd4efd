// The door of the example's module.
//
//   [[module]]
//   name = "turner"
//   file = "turner"
//
//   [module.settings]
//   port = "/dev/serial/by-id/usb-Turner-if00"
//
//   [module.settings.axis.pan]
//   counts_per_deg = 100
//   max_velocity_deg_s = 60
//   max_acceleration_deg_s2 = 600
#include <exception>

#include "drivers/api/module.h"
#include "share/examples/driver/axis.h"

namespace {

using namespace rig;

struct Settings {
  drivers::SerialSettings serial;
  drivers::RetryPolicy policy;
  drivers::AxisSettings axis;
};

// Notes every mistake in the table, so that one run of `rigd --check` tells them all.
Settings read(const base::ConfigTable& table) {
  Settings settings;
  drivers::SerialSettings usual;
  usual.baud = 115200;
  settings.serial = drivers::read_serial_settings(table, usual);
  settings.policy = drivers::read_retry_policy(table);
  const auto axes = drivers::axis_tables(table);
  for (const auto& [name, axis] : axes) settings.axis = drivers::read_axis_settings(name, axis);
  if (axes.size() > 1) table.error("axis", "the controller has one axis");
  return settings;
}

void check(const base::ConfigTable& settings) noexcept {
  (void)read(settings);
}

base::Result<std::vector<drivers::Device>> open(const drivers::OpenContext& context) noexcept {
  try {
    const Settings settings = read(context.settings);
    if (auto fine = context.settings.noted(); !fine) return base::pass(fine);
    std::vector<drivers::Device> devices;
    // The line is opened by the first call: a controller that is not there yet is lost, not an error.
    devices.push_back({settings.axis.name, settings.serial.path,
                       std::make_unique<drivers::turner::TurnerAxis>(settings.axis, settings.serial,
                                                                     settings.policy, context.clock)});
    return devices;
  } catch (const std::exception& error) {
    return base::fail(base::ErrorCode::device, error.what(), context.instance);
  }
}

constexpr drivers::ModuleEntry kEntry{drivers::kAbiTag, "turner", &check, &open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const rig::drivers::ModuleEntry* rig_driver_module() {
  return &kEntry;
}
