#include "drivers/modbus_axis/settings.h"

#include <algorithm>
#include <arpa/inet.h>
#include <map>

#include "core/base/files.h"
#include "core/base/units.h"

namespace rig::drivers::modbus {

using base::ConfigTable;
using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {

using Profiles = std::map<std::string, std::shared_ptr<const Profile>>;

// Drives of one kind share what was read of their file; a mistake in it is told once.
std::shared_ptr<const Profile> read_profile(const ConfigTable& table, const std::string& name,
                                            Profiles& profiles) {
  if (const auto known = profiles.find(name); known != profiles.end()) return known->second;
  std::shared_ptr<const Profile>& made = profiles[name];
  const auto path = find_profile(name);
  if (!path) {
    table.error("profile", path.error().what, path.error().hint);
    return nullptr;
  }
  const auto text = base::read_file(*path);
  if (!text) {
    table.error("profile", text.error().text());
    return nullptr;
  }
  auto profile = parse_profile(*text, path->string());
  if (!profile) {
    table.error("profile", "the drive's description has mistakes:\n" + profile.error().text());
    return nullptr;
  }
  made = std::make_shared<const Profile>(std::move(*profile));
  return made;
}

std::optional<DriveSettings::SoftLimits> read_soft_limits(const ConfigTable& table, const Profile& profile) {
  if (!table.has("soft_low_deg") && !table.has("soft_high_deg")) return std::nullopt;
  const double low = table.number("soft_low_deg", {-36000, 36000});
  const double high = table.number("soft_high_deg", {-36000, 36000});
  if (low >= high) table.error("soft_high_deg", "must be above soft_low_deg");
  if (profile.soft_limits.empty()) {
    table.error("soft_low_deg", fmt::format("'{}' has no soft limits in its description", profile.name));
  }
  return DriveSettings::SoftLimits{base::radians(low), base::radians(high)};
}

OptionValues read_options(const ConfigTable& table, const Profile& profile) {
  OptionValues values;
  const auto given = table.table_if("drive");
  for (const Option& option : profile.options) {
    values.push_back(given ? given->integer_or(option.name, option.fallback, option.low, option.high)
                           : option.fallback);
  }
  return values;
}

// What the line of these drives is from the factory; where they differ, the settings must say.
SerialSettings usual_line(const ConfigTable& settings, const std::vector<DriveSettings>& drives) {
  SerialSettings usual;
  if (drives.empty()) return usual;
  const LineDefaults& first = drives.front().profile->line;
  usual.baud = first.baud;
  usual.parity = first.parity;
  usual.stop_bits = first.stop_bits;
  const auto differs = [&](const char* key, auto member) {
    const bool same = std::all_of(drives.begin(), drives.end(), [&](const DriveSettings& drive) {
      return drive.profile->line.*member == first.*member;
    });
    if (!same && !settings.has(key)) {
      settings.error(key, "is missing: the drives on this line differ in it from the factory",
                     "set all of them alike, and say how");
    }
  };
  differs("baud", &LineDefaults::baud);
  differs("parity", &LineDefaults::parity);
  differs("stop_bits", &LineDefaults::stop_bits);
  return usual;
}

// IPv4, or IPv6 with or without its interface ("fe80::1%eth0").
bool is_address(const std::string& host) {
  in6_addr address{};
  return ::inet_pton(AF_INET, host.c_str(), &address) == 1 ||
         ::inet_pton(AF_INET6, host.substr(0, host.find('%')).c_str(), &address) == 1;
}

WireSettings read_wire(const ConfigTable& settings, const std::vector<DriveSettings>& drives) {
  WireSettings wire;
  const auto gap = milliseconds(settings.integer_or("gap_ms", 0, 0, 1000));
  wire.gap = gap;
  if (settings.has("host")) {
    wire.host = settings.text("host");
    // Each connection would look a name up, in the middle of a call, and nothing bounds how long that takes.
    if (!is_address(wire.host)) {
      settings.error("host", fmt::format("'{}' is no IP address", wire.host),
                     "names are not looked up: give the drive or the gateway a fixed address");
    }
    wire.tcp_port = static_cast<int>(settings.integer_or("tcp_port", wire.tcp_port, 1, 65535));
    if (settings.has("port"))
      settings.error("port", "stands beside 'host'", "a serial line or a network, not both");
    return wire;
  }
  wire.serial = read_serial_settings(settings, usual_line(settings, drives));
  wire.gap = std::max<microseconds>(wire.gap, silent_interval(wire.serial.baud));
  for (const DriveSettings& drive : drives) {
    wire.gap = std::max<microseconds>(wire.gap, milliseconds(drive.profile->line.gap_ms));
  }
  return wire;
}

}  // namespace

ModuleSettings read_settings(const ConfigTable& settings) {
  ModuleSettings module;
  const std::string usual_profile = settings.text_or("profile", "");
  Profiles profiles;
  std::map<int, std::string> slaves;
  for (const auto& [name, table] : axis_tables(settings)) {
    DriveSettings drive;
    drive.axis = read_axis_settings(name, table);
    drive.slave = static_cast<int>(table.integer("slave", 1, 247));
    if (const auto [first, fresh] = slaves.emplace(drive.slave, name); !fresh) {
      table.error("slave", fmt::format("{} is axis '{}' already", drive.slave, first->second));
    }
    const std::string profile =
        table.has("profile") || usual_profile.empty() ? table.text("profile") : usual_profile;
    if (profile.empty()) continue;
    drive.profile = read_profile(table, profile, profiles);
    if (!drive.profile) {
      if (const auto unread = table.table_if("drive")) unread->leave_to_others();
      continue;
    }
    drive.options = read_options(table, *drive.profile);
    drive.soft_limits = read_soft_limits(table, *drive.profile);
    module.drives.push_back(std::move(drive));
  }
  module.wire = read_wire(settings, module.drives);
  module.retry = read_retry_policy(settings);
  module.wire.answer = module.retry.answer;
  return module;
}

}  // namespace rig::drivers::modbus
