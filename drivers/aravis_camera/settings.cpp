#include "drivers/aravis_camera/settings.h"

#include <cmath>

namespace rig::drivers::aravis {

using base::ConfigTable;
using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {

constexpr double kMostPixels = 65535;

std::optional<bool> read_optional(const ConfigTable& table, std::string_view key) {
  if (!table.has(key)) return std::nullopt;
  return table.boolean_or(key, false);
}

void read_whom(const ConfigTable& table, Settings& settings) {
  int named = 0;
  const auto take = [&](const char* key, FindBy by) {
    if (!table.has(key)) return;
    ++named;
    settings.find_by = by;
    settings.find = table.text(key);
    if (settings.find.empty()) table.error(key, "is empty");
  };
  take("id", FindBy::id);
  take("serial", FindBy::serial);
  take("address", FindBy::address);
  if (named != 1) {
    table.error("", "names the camera by exactly one of id, serial and address",
                "arv-tool-0.8 lists what is there");
  }
  settings.transport = table.choice_or("transport", "any", {"any", "gige", "usb", "fake"});
  if (settings.find_by == FindBy::address && settings.transport == "usb") {
    table.error("address", "a USB camera has none: name it by id or serial");
  }
}

void read_image(const ConfigTable& table, Settings& settings) {
  const std::string name = table.choice_or("pixel_format", "Mono16", pixel_format_names());
  if (const PixelFormat* format = find_pixel_format(name)) settings.format = *format;
  settings.shift_right = static_cast<int>(table.integer_or("shift_right", 0, 0, 8));
  if (settings.shift_right != 0 && settings.format.bits != 16) {
    table.error("shift_right", "is only for pixel formats of 16 bits: the others are right-aligned");
  }
  const auto pixels = [&](const char* key) {
    return static_cast<int>(table.integer_or(key, 0, 0, static_cast<std::int64_t>(kMostPixels)));
  };
  settings.width = pixels("width");
  settings.height = pixels("height");
  settings.offset_x = pixels("offset_x");
  settings.offset_y = pixels("offset_y");
  if (!keeps_phase(settings.format, settings.offset_x, settings.offset_y)) {
    table.error(settings.offset_x % 2 != 0 ? "offset_x" : "offset_y",
                "must be even with a Bayer format: an odd one would change the pattern");
  }
  if (table.has("readout_ms")) settings.readout_s = table.number("readout_ms", {0, 60000}) * 1e-3;
  settings.rolling_shutter = read_optional(table, "rolling_shutter");
}

void read_features(const ConfigTable& table, Settings& settings) {
  if (!table.has("features")) return;
  for (const std::string& line : table.texts("features")) {
    const auto at = line.find('=');
    if (at == std::string::npos || at == 0 || at + 1 == line.size()) {
      table.error("features", fmt::format("'{}' is not NAME=VALUE", line));
      continue;
    }
    settings.features.emplace_back(line.substr(0, at), line.substr(at + 1));
  }
}

void read_exposing(const ConfigTable& table, Settings& settings) {
  settings.trigger_line = table.text_or("trigger_line", "");
  if (settings.trigger_line == "Software") {
    table.error("trigger_line", "is an input of the camera; without one its own command triggers it");
  }
  const std::string edge = table.choice_or("trigger_edge", "rising", {"rising", "falling"});
  settings.trigger_edge = edge == "rising" ? "RisingEdge" : "FallingEdge";
  settings.gain = read_gain_scale(table);
  settings.use_chunks = table.boolean_or("chunks", true);
  settings.count_frames = table.boolean_or("count_frames", true);
  settings.temperature_feature = table.text_or("temperature_feature", "");
  settings.temperature_selector = table.text_or("temperature_selector", "");
}

void read_network(const ConfigTable& table, Settings& settings) {
  settings.packet_size = static_cast<int>(table.integer_or("packet_size", 0, 0, 65535));
  if (settings.packet_size != 0 && settings.packet_size < 220) {
    table.error("packet_size", "is at least 220 bytes, or 0: the largest that passes");
  }
  settings.packet_delay_ns = table.integer_or("packet_delay_ns", 0, 0, 1'000'000'000);
  settings.packet_resend = table.boolean_or("packet_resend", true);
  settings.packet_sockets = table.boolean_or("packet_sockets", false);
  settings.socket_buffer_bytes =
      static_cast<int>(table.integer_or("socket_buffer_kib", 4096, 64, 1 << 20)) * 1024;
  const auto ms = [&](const char* key, double usual, base::Range range) {
    return microseconds(std::llround(table.number_or(key, usual, range) * 1e3));
  };
  settings.packet_timeout = ms("packet_timeout_ms", 20, {0.1, 1000});
  settings.frame_retention = ms("frame_retention_ms", 100, {1, 10000});
  settings.buffers = static_cast<int>(table.integer_or("buffers", 4, 2, 32));
}

}  // namespace

bool keeps_phase(const PixelFormat& format, int offset_x, int offset_y) {
  return format.bayer == "none" || (offset_x % 2 == 0 && offset_y % 2 == 0);
}

Settings read_settings(const ConfigTable& table) {
  Settings settings;
  settings.device = table.text_or("name", "camera");
  if (settings.device.empty()) table.error("name", "is empty");
  read_whom(table, settings);
  read_image(table, settings);
  read_features(table, settings);
  read_exposing(table, settings);
  read_network(table, settings);
  settings.answer = milliseconds(table.integer_or("answer_ms", 1000, 50, 60000));
  settings.open_within = milliseconds(table.integer_or("open_ms", 10'000, 1000, 600'000));
  return settings;
}

}  // namespace rig::drivers::aravis
