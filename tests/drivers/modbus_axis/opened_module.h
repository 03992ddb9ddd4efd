// The module on settings written out in a test.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <string>

#include "drivers/modbus_axis/modbus_axis.h"

namespace rig::drivers::modbus {

/// What rigd does with [module.settings]: checked, then opened.
inline Result<std::vector<Device>> open_module(const std::string& settings, base::Clock& clock) {
  const auto table = base::ConfigTable::parse(settings, "rig.toml");
  if (!table) return base::pass(table);
  check_settings(*table);
  if (auto fine = table->finish(); !fine) return base::pass(fine);
  const OpenContext context{"drives", *table, {}, clock, [](base::LogLevel, std::string_view) {}};
  return open_devices(context);
}

inline Axis& axis_of(const Device& device) {
  return *std::get<std::unique_ptr<Axis>>(device.is);
}

/// One axis at a slave's number, 1000 counts a degree, as fast as the tests need.
inline std::string axis_settings(const std::string& name, int slave, const std::string& more = "") {
  return fmt::format(R"(
[axis.{}]
slave = {}
counts_per_deg = 1000
max_velocity_deg_s = 120
max_acceleration_deg_s2 = 1000
{})",
                     name, slave, more);
}

}  // namespace rig::drivers::modbus
