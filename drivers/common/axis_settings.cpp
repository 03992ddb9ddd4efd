#include "drivers/common/axis_settings.h"

#include "core/base/units.h"

namespace rig::drivers {

namespace {

constexpr double kDegreesPerRadian = 180 / base::kPi;

}  // namespace

std::vector<std::pair<std::string, base::ConfigTable>> axis_tables(const base::ConfigTable& settings) {
  std::vector<std::pair<std::string, base::ConfigTable>> tables;
  const auto axes = settings.table("axis");
  for (const std::string& name : axes.keys()) tables.emplace_back(name, axes.table(name));
  if (tables.empty()) {
    settings.error("axis", "the module is given no axis", "add a table [module.settings.axis.NAME]");
  }
  return tables;
}

AxisSettings read_axis_settings(const std::string& name, const base::ConfigTable& table,
                                bool device_knows_scale) {
  AxisSettings axis;
  axis.name = name;
  if (!device_knows_scale) {
    axis.scale.counts_per_rad = table.number("counts_per_deg", {1e-3, 1e7}) * kDegreesPerRadian;
  }
  axis.scale.reversed = table.boolean_or("reversed", false);
  axis.scale.zero_rad = base::radians(table.number_or("zero_deg", 0, {-360, 360}));
  axis.max_velocity_rad_s = base::radians(table.number("max_velocity_deg_s", {1e-3, 1e4}));
  axis.max_acceleration_rad_s2 = base::radians(table.number("max_acceleration_deg_s2", {1e-3, 1e5}));
  return axis;
}

}  // namespace rig::drivers
