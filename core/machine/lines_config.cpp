#include "core/machine/lines_config.h"

#include <algorithm>
#include <map>

namespace rig::machine {

using base::ConfigTable;

namespace {

constexpr const char* kEmergencyStop = "lines.emergency_stop";
constexpr const char* kCameraTrigger = "lines.camera_trigger";

}  // namespace

LinesConfig read_lines(const ConfigTable& lines,
                       const std::function<DeviceRef(const ConfigTable&)>& read_device) {
  LinesConfig config;
  std::map<std::array<std::string, 3>, std::string> taken;
  const auto read = [&](const ConfigTable& table, const std::string& part) {
    LineRef ref{read_device(table), table.text("line")};
    if (ref.line.empty()) return ref;
    const auto [at, first] = taken.emplace(std::array{ref.device.module, ref.device.device, ref.line}, part);
    if (!first) {
      table.error("line",
                  fmt::format("line '{}' of device '{}' of module '{}' is that of [{}] already", ref.line,
                              ref.device.device, ref.device.module, at->second),
                  "each part needs a line of its own");
    }
    return ref;
  };
  if (const auto stop = lines.table_if("emergency_stop")) config.emergency_stop = read(*stop, kEmergencyStop);
  if (const auto trigger = lines.table_if("camera_trigger")) {
    config.camera_trigger =
        TriggerLine{read(*trigger, kCameraTrigger), 1e-6 * trigger->number_or("pulse_us", 1000, {1, 1e6})};
  }
  const auto limit = lines.table_if("limit");
  for (const std::string& name : limit ? limit->keys() : std::vector<std::string>()) {
    const auto axis = std::find(kAxisNames.begin(), kAxisNames.end(), name);
    const auto table = limit->table_if(name);
    if (axis == kAxisNames.end()) {
      limit->error(name, fmt::format("there is no axis '{}'", name), "roll, tilt, pan or arm");
      if (table) table->leave_to_others();
      continue;
    }
    if (!table) continue;
    const auto i = static_cast<std::size_t>(axis - kAxisNames.begin());
    for (std::size_t end = 0; end < kEnds; ++end) {
      if (const auto line = table->table_if(kEndNames[end]))
        config.limit[i][end] = read(*line, limit_part(i, end));
    }
    if (table->keys().empty()) {
      table->error("", "names no line",
                   fmt::format("[{}] or [{}]", limit_part(i, kLow), limit_part(i, kHigh)));
    }
  }
  return config;
}

std::string limit_part(std::size_t axis, std::size_t end) {
  return fmt::format("lines.limit.{}.{}", kAxisNames[axis], kEndNames[end]);
}

std::vector<LinePart> line_parts(const LinesConfig& lines) {
  std::vector<LinePart> parts;
  if (lines.emergency_stop) parts.push_back({kEmergencyStop, *lines.emergency_stop});
  if (lines.camera_trigger) parts.push_back({kCameraTrigger, lines.camera_trigger->line});
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    for (std::size_t end = 0; end < kEnds; ++end) {
      if (const auto& line = lines.limit[i][end]) parts.push_back({limit_part(i, end), *line});
    }
  }
  return parts;
}

std::string lines_name(const LinesConfig& lines, const DeviceRef& device) {
  const std::vector<LinePart> parts = line_parts(lines);
  const auto same = [&](const LinePart& part) { return part.line.device == device; };
  if (std::all_of(parts.begin(), parts.end(), same)) return "lines";
  return fmt::format("lines {}/{}", device.module, device.device);
}

}  // namespace rig::machine
