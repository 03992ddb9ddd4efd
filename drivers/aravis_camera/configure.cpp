#include "drivers/aravis_camera/configure.h"

#include <array>

namespace rig::drivers::aravis {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;

namespace {

// What the wires carry of samples, in bytes per second: gigabit Ethernet and USB 3.
constexpr double kEthernet = 115e6;
constexpr double kUsb = 380e6;

bool has(ArvCamera* camera, const char* feature) {
  return arv_camera_is_feature_available(camera, feature, nullptr) != FALSE;
}

bool has_entry(ArvCamera* camera, const char* feature, const char* entry) {
  return has(camera, feature) &&
         arv_camera_is_enumeration_entry_available(camera, feature, entry, nullptr) != FALSE;
}

Result<void> set_entry_if_there(ArvCamera* camera, const char* feature, const char* entry) {
  if (!has_entry(camera, feature, entry)) return {};
  return attempt(fmt::format("to set {} to {}", feature, entry),
                 [&](GError** e) { arv_camera_set_string(camera, feature, entry, e); });
}

Result<void> set_features(ArvCamera* camera, const Settings& settings) {
  for (const auto& [name, value] : settings.features) {
    const std::string line = fmt::format("{}={}", name, value);
    auto done = attempt("to set " + line, [&, &feature = name](GError** e) {
      if (!has(camera, feature.c_str())) {
        g_set_error(e, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_FEATURE_NOT_FOUND, "it has no such feature");
        return;
      }
      arv_device_set_features_from_string(arv_camera_get_device(camera), line.c_str(), e);
    });
    if (!done) return done;
  }
  return {};
}

// The automatic parts that would change an exposure behind our back.
Result<void> switch_off_automatics(ArvCamera* camera) {
  constexpr std::array<std::pair<const char*, const char*>, 6> kOff{{{"ExposureAuto", "Off"},
                                                                     {"GainAuto", "Off"},
                                                                     {"BlackLevelAuto", "Off"},
                                                                     {"BalanceWhiteAuto", "Off"},
                                                                     {"ExposureMode", "Timed"},
                                                                     {"AcquisitionMode", "Continuous"}}};
  for (const auto& [feature, entry] : kOff) {
    if (auto done = set_entry_if_there(camera, feature, entry); !done) return done;
  }
  return {};
}

Result<void> set_format(ArvCamera* camera, const Settings& settings) {
  const char* format = settings.format.name.c_str();
  if (!has_entry(camera, "PixelFormat", format)) {
    guint count = 0;
    const char** all = arv_camera_dup_available_pixel_formats_as_strings(camera, &count, nullptr);
    std::string list;
    for (guint i = 0; i < count; ++i) list += (i == 0 ? "" : ", ") + std::string(all[i]);
    g_free(all);
    return fail(ErrorCode::device, fmt::format("it has no pixel format {}", format), {}, "it has " + list);
  }
  return attempt(fmt::format("to set its pixel format to {}", format),
                 [&](GError** e) { arv_camera_set_pixel_format_from_string(camera, format, e); });
}

Result<void> set_region(ArvCamera* camera, const Settings& settings, Configured& made) {
  int width = settings.width, height = settings.height;
  gint most_across = 0, most_down = 0;
  bool fits = true;
  auto done = attempt("to set its region", [&](GError** e) {
    // The bounds are those beside the present offset.
    arv_camera_set_region(camera, 0, 0, -1, -1, e);
    gint least = 0;
    if (*e == nullptr) arv_camera_get_width_bounds(camera, &least, &most_across, e);
    if (*e == nullptr) arv_camera_get_height_bounds(camera, &least, &most_down, e);
    if (*e != nullptr) return;
    if (width == 0) width = most_across - settings.offset_x;
    if (height == 0) height = most_down - settings.offset_y;
    // Not every camera refuses what its sensor has not.
    fits = width > 0 && height > 0 && settings.offset_x + width <= most_across &&
           settings.offset_y + height <= most_down;
    if (fits) arv_camera_set_region(camera, settings.offset_x, settings.offset_y, width, height, e);
  });
  if (!done) return done;
  if (!fits) {
    return fail(
        ErrorCode::device,
        fmt::format("its sensor has {} x {} pixels, too few for the region asked for: {} x {} at ({}, {})",
                    most_across, most_down, width, height, settings.offset_x, settings.offset_y));
  }
  gint x = 0, y = 0, w = 0, h = 0;
  done = attempt("to read its region", [&](GError** e) { arv_camera_get_region(camera, &x, &y, &w, &h, e); });
  if (!done) return done;
  if (w != width || h != height || x != settings.offset_x || y != settings.offset_y) {
    return fail(ErrorCode::device,
                fmt::format("its region is {} x {} at ({}, {}), asked for were {} x {} at ({}, {})", w, h, x,
                            y, width, height, settings.offset_x, settings.offset_y),
                {}, "cameras take sizes and offsets in steps");
  }
  made.offset_x = x;
  made.offset_y = y;
  made.capabilities.width = w;
  made.capabilities.height = h;
  return {};
}

Result<void> set_trigger(ArvCamera* camera, const Settings& settings, Configured& made) {
  const char* source = settings.trigger_line.empty() ? "Software" : settings.trigger_line.c_str();
  auto done = attempt(fmt::format("to set its trigger to {}", source),
                      [&](GError** e) { arv_camera_set_trigger(camera, source, e); });
  if (!done) return done;
  if (!settings.trigger_line.empty()) {
    const char* edge = settings.trigger_edge.c_str();
    done = attempt(fmt::format("to set TriggerActivation to {}", edge),
                   [&](GError** e) { arv_camera_set_string(camera, "TriggerActivation", edge, e); });
    if (!done) return done;
  }
  if (has_entry(camera, "AcquisitionStatusSelector", "FrameTriggerWait") &&
      has(camera, "AcquisitionStatus")) {
    done = set_entry_if_there(camera, "AcquisitionStatusSelector", "FrameTriggerWait");
    if (!done) return done;
    made.tells_readiness = true;
  }
  return {};
}

Result<void> set_chunks(ArvCamera* camera, const Settings& settings, Configured& made) {
  if (!has(camera, "ChunkModeActive")) return {};
  auto done = attempt("to set ChunkModeActive", [&](GError** e) {
    arv_camera_set_boolean(camera, "ChunkModeActive", settings.use_chunks ? TRUE : FALSE, e);
  });
  if (!done || !settings.use_chunks) return done;
  for (const char* chunk : {"ExposureTime", "Timestamp"}) {
    if (!has_entry(camera, "ChunkSelector", chunk)) continue;
    done = attempt(fmt::format("to enable the chunk {}", chunk), [&](GError** e) {
      arv_camera_set_string(camera, "ChunkSelector", chunk, e);
      if (*e == nullptr && arv_camera_get_boolean(camera, "ChunkEnable", e) == FALSE && *e == nullptr) {
        arv_camera_set_boolean(camera, "ChunkEnable", TRUE, e);
      }
    });
    if (!done) return done;
    made.has_chunks = true;
  }
  return {};
}

Result<void> set_network(ArvCamera* camera, const Settings& settings) {
  if (arv_camera_is_gv_device(camera) == FALSE) return {};
  arv_camera_gv_set_stream_options(camera, settings.packet_sockets
                                               ? ARV_GV_STREAM_OPTION_NONE
                                               : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  if (settings.packet_size == 0) {
    arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_ONCE);
  } else {
    arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
    auto done = attempt(fmt::format("to set its packet size to {}", settings.packet_size),
                        [&](GError** e) { arv_camera_gv_set_packet_size(camera, settings.packet_size, e); });
    if (!done) return done;
  }
  if (settings.packet_delay_ns == 0) return {};
  return attempt("to set its packet delay",
                 [&](GError** e) { arv_camera_gv_set_packet_delay(camera, settings.packet_delay_ns, e); });
}

Result<void> read_bounds(ArvCamera* camera, Configured& made) {
  double least_us = 0, most_us = 0;
  auto done = attempt("to read the bounds of its exposure", [&](GError** e) {
    arv_camera_get_exposure_time_bounds(camera, &least_us, &most_us, e);
  });
  if (!done) return done;
  made.capabilities.min_exposure_s = least_us * 1e-6;
  made.capabilities.max_exposure_s = most_us * 1e-6;
  made.has_gain = arv_camera_is_gain_available(camera, nullptr) != FALSE;
  if (!made.has_gain) return {};
  made.whole_gains = true;
  for (const char* name : {"Gain", "GainRaw", "GainAbs"}) {
    if (ARV_IS_GC_FLOAT(arv_device_get_feature(arv_camera_get_device(camera), name)))
      made.whole_gains = false;
  }
  return attempt("to read the bounds of its gain",
                 [&](GError** e) { arv_camera_get_gain_bounds(camera, &made.min_gain, &made.max_gain, e); });
}

Result<void> read_sizes(ArvCamera* camera, const Settings& settings, Configured& made) {
  const auto payload = ask_number("to read its payload size", [&](GError** e) {
    return static_cast<double>(arv_camera_get_payload(camera, e));
  });
  if (!payload) return pass(payload);
  CameraCapabilities& can = made.capabilities;
  const auto image = bytes_of(settings.format.packing,
                              static_cast<std::size_t>(can.width) * static_cast<std::size_t>(can.height));
  made.payload_bytes = static_cast<std::size_t>(*payload);
  if (made.payload_bytes < image) {
    return fail(ErrorCode::device,
                fmt::format("it sends {} bytes for an image of {}", made.payload_bytes, image));
  }
  can.readout_s = 0;
  if (arv_camera_is_gv_device(camera) != FALSE) can.readout_s = *payload / kEthernet;
  if (arv_camera_is_uv_device(camera) != FALSE) can.readout_s = *payload / kUsb;
  if (settings.readout_s) can.readout_s = *settings.readout_s;
  return {};
}

// The lines of a rolling shutter end one after the other: until the last has, the rig stands still.
bool is_rolling(ArvCamera* camera, const Settings& settings) {
  if (settings.rolling_shutter) return *settings.rolling_shutter;
  for (const char* feature : {"SensorShutterMode", "ShutterMode"}) {
    if (!has(camera, feature)) continue;
    const char* mode = arv_camera_get_string(camera, feature, nullptr);
    return mode != nullptr && std::string(mode) != "Global";
  }
  return false;
}

Result<void> find_temperature(ArvCamera* camera, const Settings& settings, Configured& made) {
  if (!settings.temperature_selector.empty()) {
    const char* selector = settings.temperature_selector.c_str();
    auto done = attempt(fmt::format("to set DeviceTemperatureSelector to {}", selector), [&](GError** e) {
      arv_camera_set_string(camera, "DeviceTemperatureSelector", selector, e);
    });
    if (!done) return done;
  }
  if (!settings.temperature_feature.empty()) {
    if (!has(camera, settings.temperature_feature.c_str())) {
      return fail(ErrorCode::device, "it has no feature " + settings.temperature_feature);
    }
    made.temperature = settings.temperature_feature;
    return {};
  }
  for (const char* feature : {"DeviceTemperature", "TemperatureAbs"}) {
    if (made.temperature.empty() && has(camera, feature)) made.temperature = feature;
  }
  return {};
}

}  // namespace

Result<Configured> configure(ArvCamera* camera, const Settings& settings) {
  Configured made;
  made.capabilities.bits = settings.bits();
  made.capabilities.bayer = settings.format.bayer;
  made.runs_free = ARV_IS_FAKE_DEVICE(arv_camera_get_device(camera));
  // A process that died may have left it taking frames: then most of what follows is locked.
  if (auto done =
          attempt("to stop taking frames", [&](GError** e) { arv_camera_stop_acquisition(camera, e); });
      !done) {
    return pass(done);
  }
  if (auto done = set_features(camera, settings); !done) return pass(done);
  if (auto done = switch_off_automatics(camera); !done) return pass(done);
  if (auto done = set_format(camera, settings); !done) return pass(done);
  if (auto done = set_region(camera, settings, made); !done) return pass(done);
  if (auto done = set_trigger(camera, settings, made); !done) return pass(done);
  if (auto done = set_chunks(camera, settings, made); !done) return pass(done);
  if (auto done = set_network(camera, settings); !done) return pass(done);
  if (auto done = read_bounds(camera, made); !done) return pass(done);
  if (auto done = read_sizes(camera, settings, made); !done) return pass(done);
  if (auto done = find_temperature(camera, settings, made); !done) return pass(done);
  made.can_abort = has(camera, "AcquisitionAbort");
  made.capabilities.overlaps_motion = !is_rolling(camera, settings);
  return made;
}

}  // namespace rig::drivers::aravis
