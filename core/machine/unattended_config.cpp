#include "core/machine/unattended_config.h"

#include <algorithm>

#include "core/base/units.h"

namespace rig::machine {

namespace {

constexpr double kMostHours = 1e6;
constexpr double kBytesPerMb = 1e6;

SuspendConfig read_suspend(const base::ConfigTable& table) {
  SuspendConfig suspend;
  suspend.light_band = table.number_or("light_band", suspend.light_band, {0, 1});
  suspend.disk_margin_bytes =
      kBytesPerMb * table.number_or("disk_margin_mb", suspend.disk_margin_bytes / kBytesPerMb, {0, 1e9});
  if (table.has("max_temperature_c")) suspend.max_temperature_c = table.number("max_temperature_c", {0, 200});
  suspend.limit_s = table.number_or("limit_s", suspend.limit_s, {1, 1e7});
  suspend.person_limit_s = table.number_or("person_limit_s", suspend.person_limit_s, {1, 1e7});
  suspend.fail_at_limit = table.choice_or("at_limit", "hold", {"hold", "fail"}) == "fail";
  return suspend;
}

NotifyConfig read_notify(const base::ConfigTable& table) {
  NotifyConfig notify;
  notify.command = table.texts("command");
  if (!notify.command.empty() && notify.command.front().substr(0, 1) != "/") {
    table.error("command", "must begin with the absolute path of a program",
                "it is run without a shell and without a search path");
  }
  notify.timeout_s = table.number_or("timeout_s", notify.timeout_s, {1, 3600});
  return notify;
}

}  // namespace

UnattendedConfig read_unattended(const base::ConfigTable& root) {
  UnattendedConfig unattended;
  if (const auto suspend = root.table_if("suspend")) unattended.suspend = read_suspend(*suspend);
  if (const auto notify = root.table_if("notify")) unattended.notify = read_notify(*notify);
  unattended.reference = read_reference(root);
  if (const auto park = root.table_if("park")) {
    const auto angles = park->numbers("angles_deg", kAxisCount, {-360, 360});
    if (angles.size() == kAxisCount) {
      unattended.park_rad.emplace();
      std::transform(angles.begin(), angles.end(), unattended.park_rad->begin(), base::radians);
    }
  }
  if (const auto light = root.table_if("light")) {
    unattended.lamp_life_hours = light->number_or("life_hours", 0, {0, kMostHours});
  }
  return unattended;
}

}  // namespace rig::machine
