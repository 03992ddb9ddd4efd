#include "drivers/cia402_axis/settings.h"

#include <map>

#include "core/base/units.h"

namespace rig::drivers::cia402 {

using base::ConfigTable;
using base::radians;
using std::chrono::milliseconds;

namespace {

constexpr base::Range kSpeed{1e-3, 1e4}, kAcceleration{1e-3, 1e5}, kUnit{1e-9, 1e9};

NetworkSettings read_network(const ConfigTable& table) {
  NetworkSettings network;
  network.interface = table.text("interface");
  if (table.has("interface") && network.interface.empty()) {
    table.error("interface", "is empty", "name a CAN interface: \"can0\"");
  }
  network.retry = read_retry_policy(table);
  network.heartbeat = milliseconds(table.integer_or("heartbeat_ms", network.heartbeat.count(), 0, 60000));
  network.heartbeat_timeout =
      milliseconds(table.integer_or("heartbeat_timeout_ms", 3 * network.heartbeat.count(), 0, 600000));
  if (network.heartbeat.count() != 0 && network.heartbeat_timeout <= network.heartbeat) {
    table.error("heartbeat_timeout_ms", "has to be more than heartbeat_ms", "three times as much is usual");
  }
  return network;
}

void read_reference(const ConfigTable& table, DriveSettings& drive) {
  const bool keeps = table.boolean_or("keeps_reference", false);
  const std::string from =
      table.choice_or("homed_by", "homing_mode", {"homing_mode", "statusword_bit", "session"});
  if (keeps && table.has("homed_by")) {
    table.error("homed_by", "an axis with keeps_reference = true is always homed", "remove one of the two");
  }
  drive.reference = keeps                      ? Reference::absolute
                    : from == "session"        ? Reference::session
                    : from == "statusword_bit" ? Reference::statusword_bit
                                               : Reference::homing_mode;
  // Those that CiA 402 leaves to the maker.
  constexpr int kMakers[] = {8, 14, 15};
  if (drive.reference == Reference::statusword_bit) {
    drive.referenced_bit = static_cast<int>(table.integer("referenced_bit", 8, 15));
    if (std::find(std::begin(kMakers), std::end(kMakers), drive.referenced_bit) == std::end(kMakers)) {
      table.error("referenced_bit", "is none of the bits that are the maker's to use", "8, 14 or 15");
    }
  }
  if (!keeps || table.has("homing_method")) {
    HomingSettings& homing = drive.homing.emplace();
    homing.method = static_cast<std::int8_t>(table.integer("homing_method", -128, 127));
    if (table.has("homing_method") && homing.method == 0) {
      table.error("homing_method", "0 is no method", "see the drive's manual, object 6098");
    }
    homing.speed_rad_s = radians(table.number("homing_speed_deg_s", kSpeed));
    homing.creep_rad_s = radians(table.number("homing_creep_deg_s", kSpeed));
    homing.acceleration_rad_s2 = radians(table.number_or(
        "homing_acceleration_deg_s2", base::degrees(drive.axis.max_acceleration_rad_s2), kAcceleration));
  }
}

DriveSettings read_drive(const std::string& name, const ConfigTable& table) {
  DriveSettings drive;
  drive.axis = read_axis_settings(name, table);
  drive.node = static_cast<int>(table.integer("node", 1, 127));
  read_reference(table, drive);
  drive.limit_switches = table.boolean_or("limit_switches", drive.limit_switches);
  drive.limits_active_low = table.boolean_or("limits_active_low", drive.limits_active_low);
  drive.quick_stop_option = static_cast<std::int16_t>(
      table.integer_or("quick_stop_option", drive.quick_stop_option, kLeaveOption, 8));
  if (drive.quick_stop_option == 4) {
    table.error("quick_stop_option", "4 is no option of CiA 402",
                "6 brakes and holds; -1 leaves the drive's own");
  }
  drive.quick_stop_rad_s2 = radians(table.number_or(
      "quick_stop_deceleration_deg_s2", base::degrees(drive.axis.max_acceleration_rad_s2), kAcceleration));
  drive.stop_by_pdo = table.boolean_or("stop_by_pdo", drive.stop_by_pdo);
  drive.velocity_unit = table.number_or("velocity_units_per_count_s", drive.velocity_unit, kUnit);
  drive.acceleration_unit =
      table.number_or("acceleration_units_per_count_s2", drive.acceleration_unit, kUnit);
  return drive;
}

}  // namespace

Settings read_settings(const ConfigTable& table) {
  Settings settings;
  settings.network = read_network(table);
  std::map<int, std::string> users;
  for (const auto& [name, axis] : axis_tables(table)) {
    settings.drives.push_back(read_drive(name, axis));
    const int node = settings.drives.back().node;
    const auto [user, is_first] = users.emplace(node, name);
    if (node != 0 && !is_first) {
      axis.error("node", fmt::format("node {} is axis {} already", node, user->second));
    }
  }
  return settings;
}

}  // namespace rig::drivers::cia402
