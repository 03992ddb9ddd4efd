#include "drivers/v4l2_camera/settings.h"

#include <charconv>

namespace rig::drivers::v4l2 {

using base::ConfigTable;

namespace {

std::optional<double> read_ms(const ConfigTable& table, std::string_view key, base::Range range) {
  if (!table.has(key)) return std::nullopt;
  return table.number(key, range) * 1e-3;
}

void read_image(const ConfigTable& table, Settings& settings) {
  const std::string name = table.choice("pixel_format", pixel_format_names());
  if (const PixelFormat* format = find_pixel_format(name)) settings.format = *format;
  settings.shift_right = static_cast<int>(table.integer_or("shift_right", 0, 0, 8));
  if (settings.shift_right != 0 && settings.format.bits != 16) {
    table.error("shift_right", "is only for pixel formats of 16 bits: the others are right-aligned");
  }
  settings.width = static_cast<int>(table.integer_or("width", 0, 0, 65535));
  settings.height = static_cast<int>(table.integer_or("height", 0, 0, 65535));
  if ((settings.width == 0) != (settings.height == 0)) {
    table.error(settings.width == 0 ? "width" : "height", "width and height are said both, or neither");
  }
}

void read_controls(const ConfigTable& table, Settings& settings) {
  if (!table.has("controls")) return;
  for (const std::string& line : table.texts("controls")) {
    const auto at = line.find('=');
    std::int32_t value = 0;
    bool is_number = false;
    if (at != std::string::npos && at != 0) {
      const char* end = line.data() + line.size();
      const auto [rest, error] = std::from_chars(line.data() + at + 1, end, value);
      is_number = error == std::errc() && rest == end;
    }
    if (!is_number) {
      table.error("controls", fmt::format("'{}' is not NAME=NUMBER", line),
                  "v4l2-ctl --list-ctrls names them");
      continue;
    }
    settings.controls.emplace_back(line.substr(0, at), value);
  }
}

void read_exposing(const ConfigTable& table, Settings& settings) {
  settings.fixed_exposure_s = read_ms(table, "fixed_exposure_ms", {1e-3, 3.6e6});
  if (table.has("exposure_unit_us")) {
    settings.exposure_unit_s = table.number("exposure_unit_us", {1e-3, 1e6}) * 1e-6;
    if (settings.fixed_exposure_s) {
      table.error("exposure_unit_us", "with fixed_exposure_ms no exposure control is used");
    }
  }
  settings.longest_exposure_s = read_ms(table, "longest_exposure_ms", {1e-3, 3.6e6});
  settings.frame_interval_s = read_ms(table, "frame_interval_ms", {0.1, 60'000});
  settings.gain_control = table.text_or("gain_control", "");
  settings.gain = read_gain_scale(table);
  settings.gain.offset = table.number_or("gain_offset", 0, {-1e9, 1e9});
}

void read_timing(const ConfigTable& table, Settings& settings) {
  const std::string stamp = table.choice_or("timestamp", "as_told", {"as_told", "start", "end"});
  if (stamp == "start") settings.stamp = Stamp::start;
  if (stamp == "end") settings.stamp = Stamp::end;
  settings.measure_settling = table.boolean_or("measure_settling", true);
  settings.settle_frames = static_cast<int>(table.integer_or("settle_frames", 4, 0, kMostSettleFrames));
  settings.settle_margin = static_cast<int>(table.integer_or("settle_margin", 1, 0, kMostSettleFrames));
  settings.buffers = static_cast<int>(table.integer_or("buffers", 0, 0, 32));
  if (settings.buffers == 1) table.error("buffers", "is at least 2, or 0: as many as are needed");
  settings.open_within = std::chrono::milliseconds(table.integer_or("open_ms", 10'000, 1000, 600'000));
}

}  // namespace

Settings read_settings(const ConfigTable& table) {
  Settings settings;
  settings.name = table.text_or("name", "camera");
  if (settings.name.empty()) table.error("name", "is empty");
  settings.device = table.text("device");
  if (!settings.device.starts_with('/') && !settings.device.starts_with("unix:/")) {
    table.error("device", "is the whole path of a video device",
                "/dev/v4l/by-id/ has one for each camera that keeps its name");
  }
  settings.exclusive = table.boolean_or("exclusive", true);
  read_image(table, settings);
  read_controls(table, settings);
  read_exposing(table, settings);
  read_timing(table, settings);
  return settings;
}

}  // namespace rig::drivers::v4l2
