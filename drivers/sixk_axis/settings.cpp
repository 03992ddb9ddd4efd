#include "drivers/sixk_axis/settings.h"

#include <algorithm>
#include <cmath>

#include "core/base/units.h"

namespace rig::drivers::sixk {

namespace {

constexpr int kMostAxes = 8;

void read_encoder(const base::ConfigTable& table, ControllerAxis& axis) {
  constexpr const char* kKey = "encoder_counts_per_deg";
  if (!table.has(kKey)) return;
  const double counts_per_deg = table.number(kKey, {-1e7, 1e7});
  if (axis.servo) {
    table.error(kKey, "a servo is commanded in the counts of its encoder", "leave it out");
    return;
  }
  if (std::abs(counts_per_deg) < 1e-3) {
    table.error(kKey, "an encoder that does not count", "negative: it counts against the motor");
    return;
  }
  CountScale scale = axis.axis.scale;
  scale.counts_per_rad = std::abs(counts_per_deg) / base::radians(1);
  scale.reversed = scale.reversed != (counts_per_deg < 0);
  axis.encoder = scale;
}

ControllerAxis read_axis(const std::string& name, const base::ConfigTable& table) {
  ControllerAxis axis;
  axis.axis = read_axis_settings(name, table);
  axis.number = static_cast<int>(table.integer("number", 1, kMostAxes));
  axis.servo = table.choice_or("motor", "stepper", {"stepper", "servo"}) == "servo";
  axis.hard_limits = table.boolean_or("limit_switches", true);
  if (table.has("counts_per_turn")) {
    axis.resolution = static_cast<int>(table.integer("counts_per_turn", 1, 1'000'000));
  }
  read_encoder(table, axis);
  axis.home_upwards = table.choice_or("home_towards", "low", {"low", "high"}) == "high";
  axis.home_velocity_rad_s = base::radians(table.number("home_velocity_deg_s", {1e-3, 1e4}));
  axis.home_acceleration_rad_s2 = base::radians(table.number_or(
      "home_acceleration_deg_s2", base::degrees(axis.axis.max_acceleration_rad_s2), {1e-3, 1e5}));
  if (table.has("home_final_velocity_deg_s")) {
    axis.home_final_velocity_rad_s = base::radians(table.number("home_final_velocity_deg_s", {1e-3, 1e4}));
  }
  axis.preset_at_home = table.boolean_or("preset_at_home", false);
  return axis;
}

}  // namespace

Settings read_settings(const base::ConfigTable& table) {
  Settings settings;
  settings.serial = read_serial_settings(table, {"", 9600, 'N', 1});
  settings.retry = read_retry_policy(table);
  settings.unit = static_cast<int>(table.integer_or("unit", 0, 0, 99));
  settings.error_level = static_cast<int>(table.integer_or("error_level", 4, 1, 4));
  if (settings.error_level != 1 && settings.error_level != 4) {
    table.error("error_level", "only the levels 4 (names and prompts) and 1 (neither) are understood");
  }
  settings.echo = table.boolean_or("echo", false);
  settings.kill = table.choice_or("stop", "stop", {"stop", "kill"}) == "kill";
  if (table.has("set_up")) settings.set_up = table.texts("set_up");
  for (const std::string& command : settings.set_up) {
    const bool plain = !command.empty() && std::all_of(command.begin(), command.end(), [](char c) {
      return c >= ' ' && c <= '~' && c != '_' && c != '!' && c != ';' && c != ':';
    });
    if (!plain)
      table.error("set_up", "'" + command + "' is not one command", "as in \"1HOMBAC1\", without \"!\"");
  }
  for (const auto& [name, axis] : axis_tables(table)) {
    settings.axes.push_back(read_axis(name, axis));
    const int number = settings.axes.back().number;
    const auto same = std::count_if(settings.axes.begin(), settings.axes.end(),
                                    [&](const ControllerAxis& other) { return other.number == number; });
    if (same > 1) axis.error("number", "two axes are the controller's axis " + std::to_string(number));
  }
  return settings;
}

}  // namespace rig::drivers::sixk
