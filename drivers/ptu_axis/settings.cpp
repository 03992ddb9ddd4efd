#include "drivers/ptu_axis/settings.h"

#include "core/base/units.h"

namespace rig::drivers::ptu {

namespace {

constexpr base::Range kTravel_deg{-3600, 3600};

UnitAxis read_axis(const std::string& name, const base::ConfigTable& table, Limits limits) {
  UnitAxis axis;
  axis.axis = read_axis_settings(name, table, true);
  axis.letter = name == "tilt" ? 'T' : 'P';
  axis.where = table.where();
  if (table.has("counts_per_deg")) axis.counts_per_deg = table.number("counts_per_deg", {1e-3, 1e7});
  if (table.has("base_velocity_deg_s")) {
    axis.base_velocity_rad_s = base::radians(table.number("base_velocity_deg_s", {1e-3, 1e4}));
  }
  if (limits == Limits::user) {
    axis.user_min_rad = base::radians(table.number("user_min_deg", kTravel_deg));
    axis.user_max_rad = base::radians(table.number("user_max_deg", kTravel_deg));
    if (table.has("user_min_deg") && table.has("user_max_deg") && axis.user_min_rad >= axis.user_max_rad) {
      table.error("user_max_deg", "the user's limits leave no travel", "user_min_deg must be less");
    }
  } else {
    for (const char* key : {"user_min_deg", "user_max_deg"}) {
      if (table.has(key)) {
        (void)table.number(key, kTravel_deg);
        table.error(key, "counts only with limits = \"user\"");
      }
    }
  }
  return axis;
}

}  // namespace

Settings read_settings(const base::ConfigTable& table) {
  Settings settings;
  settings.serial = read_serial_settings(table, {"", 9600, 'N', 1});
  settings.retry = read_retry_policy(table);
  const std::string limits = table.choice_or("limits", "factory", {"factory", "user", "off"});
  settings.limits = limits == "user" ? Limits::user : limits == "off" ? Limits::off : Limits::factory;
  const std::string reset = table.choice_or("reset", "both", {"both", "mode", "axis"});
  settings.reset = reset == "mode" ? Reset::mode : reset == "axis" ? Reset::axis : Reset::both;
  settings.low_hold_power = table.choice_or("hold_power", "regular", {"regular", "low"}) == "low";
  settings.reset_within = std::chrono::seconds(table.integer_or("reset_s", 30, 1, 300));
  settings.tables_within = std::chrono::seconds(table.integer_or("tables_s", 15, 1, 120));
  for (const auto& [name, axis] : axis_tables(table)) {
    settings.axes.push_back(read_axis(name, axis, settings.limits));
    if (name != "pan" && name != "tilt") {
      axis.error("", "a pan-tilt unit has no axis '" + name + "'", "its axes are pan and tilt");
    }
  }
  return settings;
}

}  // namespace rig::drivers::ptu
