#include "drivers/tic_axis/settings.h"

#include <cmath>

#include "drivers/tic_axis/protocol.h"

namespace rig::drivers::tic {

using base::ConfigTable;
using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

Result<std::uint32_t> in_units(const CountScale& scale, double rate, double units) {
  CountScale fine = scale;
  fine.counts_per_rad *= units;
  const auto whole = fine.rate(rate);
  if (!whole) return pass(whole);
  return static_cast<std::uint32_t>(*whole);
}

Place read_place(const ConfigTable& table) {
  Place place;
  place.serial = table.text_or("serial", "");
  place.usb_path = table.text_or("usb_path", "");
  place.transport = table.text_or("transport", "usb");
  if (place.serial.empty() == place.usb_path.empty()) {
    table.error("serial", "a Tic is found either by its serial number or by its place",
                "serial = \"00123456\" (ticcmd --list) or usb_path = \"1-1.4\"");
  }
  if (place.transport != "usb" && !place.transport.starts_with("unix:")) {
    table.error("transport", fmt::format("there is no transport '{}'", place.transport), "\"usb\"");
  }
  return place;
}

void read_homing(const ConfigTable& table, TicSettings& tic) {
  const std::string homing = table.choice("homing", {"forward", "reverse", "set_here", "none"});
  if (homing == "forward") tic.homing = Homing::forward;
  if (homing == "reverse") tic.homing = Homing::reverse;
  if (homing != "set_here") return;
  tic.homing = Homing::set_here;
  tic.switch_is_forward = table.choice("home_switch", {"forward", "reverse"}) == "forward";
}

void check_rates(const ConfigTable& table, const AxisSettings& axis) {
  if (const auto ok = tic_speed(axis.scale, axis.max_velocity_rad_s); !ok) {
    table.error("max_velocity_deg_s", ok.error().what, "lower it, or choose a coarser step_mode");
  }
  if (const auto ok = tic_accel(axis.scale, axis.max_acceleration_rad_s2); !ok) {
    table.error("max_acceleration_deg_s2", ok.error().what);
  }
}

TicSettings read_tic(const std::string& name, const ConfigTable& table) {
  TicSettings tic;
  const std::size_t before = table.errors();
  tic.axis = read_axis_settings(name, table);
  if (table.errors() == before) check_rates(table, tic.axis);
  tic.place = read_place(table);
  constexpr int kMostMicrosteps = 256, kMostCurrent_ma = 9095, kMostTimeout_ms = 60000;
  constexpr double kMostVin_v = 60;
  // Feeding four times within less would keep the bus busy with little else.
  constexpr int kLeastTimeout_ms = 100;
  tic.step_mode = static_cast<int>(table.integer("step_mode", 1, kMostMicrosteps));
  if (tic.step_mode > 0 && (tic.step_mode & (tic.step_mode - 1)) != 0) {
    table.error("step_mode", "microsteps of a full step are a power of two",
                "1, 2, 4, 8, 16, 32, 64, 128 or 256");
  }
  tic.current_limit_ma = static_cast<int>(table.integer("current_limit_ma", 0, kMostCurrent_ma));
  if (table.has("command_timeout_ms")) {
    tic.command_timeout_ms =
        static_cast<int>(table.integer("command_timeout_ms", kLeastTimeout_ms, kMostTimeout_ms));
  }
  read_homing(table, tic);
  tic.stop =
      table.choice_or("stop", "halt", {"halt", "decelerate"}) == "halt" ? Stop::halt : Stop::decelerate;
  tic.min_vin_v = table.number_or("min_vin_v", 0, {0, kMostVin_v});
  return tic;
}

// Two axes with one motor would each undo what the other does.
void check_distinct(const ConfigTable& settings, const std::vector<TicSettings>& tics) {
  for (std::size_t i = 0; i < tics.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const Place &a = tics[i].place, &b = tics[k].place;
      const bool same =
          (!a.serial.empty() && a.serial == b.serial) || (!a.usb_path.empty() && a.usb_path == b.usb_path);
      if (!same) continue;
      settings.error("axis",
                     fmt::format("axes '{}' and '{}' are one Tic", tics[k].axis.name, tics[i].axis.name));
    }
  }
}

}  // namespace

Result<std::uint32_t> tic_speed(const CountScale& scale, double rad_s) {
  const auto units = in_units(scale, rad_s, kSpeedUnits);
  if (units && *units <= kMostSpeed) return units;
  return fail(ErrorCode::bad_input,
              fmt::format("{:g} microsteps/s; a Tic makes at most {}", std::abs(rad_s) * scale.counts_per_rad,
                          kMostSpeed / kSpeedUnits));
}

Result<std::uint32_t> tic_accel(const CountScale& scale, double rad_s2) {
  const auto units = in_units(scale, rad_s2, kAccelUnits);
  if (units && *units >= kLeastAccel) return units;
  return fail(ErrorCode::bad_input, fmt::format("{:g} microsteps/s^2; a Tic makes 1 to 21 million",
                                                std::abs(rad_s2) * scale.counts_per_rad));
}

ModuleSettings read_module_settings(const ConfigTable& settings) {
  ModuleSettings module;
  module.retry = read_retry_policy(settings);
  constexpr int kLeast_ms = 1000, kMost_ms = 60000;
  module.silence = std::chrono::milliseconds(
      settings.integer_or("silence_ms", module.silence.count(), kLeast_ms, kMost_ms));
  module.write_settings = settings.boolean_or("write_settings", false);
  for (const auto& [name, table] : axis_tables(settings)) module.tics.push_back(read_tic(name, table));
  check_distinct(settings, module.tics);
  return module;
}

}  // namespace rig::drivers::tic
