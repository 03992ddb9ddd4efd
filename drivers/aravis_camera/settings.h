// [module.settings] of a camera on GigE Vision or USB3 Vision.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/config.h"
#include "drivers/aravis_camera/pixel_format.h"
#include "drivers/common/camera_gain.h"

namespace rig::drivers::aravis {

enum class FindBy { id, serial, address };

struct Settings {
  std::string device = "camera";  ///< name that the module gives it
  FindBy find_by = FindBy::id;
  std::string find;               ///< the id, serial number or address
  std::string transport = "any";  ///< "any", "gige", "usb", or "fake": Aravis' own inside this process

  PixelFormat format;
  int shift_right = 0;                  ///< of samples, for a camera that puts fewer bits than 16 at the top
  int width = 0, height = 0;            ///< 0: as large as the camera has it
  int offset_x = 0, offset_y = 0;       ///< of the region on the sensor
  std::optional<double> readout_s;      ///< absent: from the image's size and the wire's speed
  std::optional<bool> rolling_shutter;  ///< absent: the camera is asked; who does not tell has a global one
  std::vector<std::pair<std::string, std::string>> features;  ///< name and value, set first, in this order

  std::string trigger_line;                 ///< "Line1"; empty: no trigger input is used
  std::string trigger_edge = "RisingEdge";  ///< TriggerActivation
  GainScale gain;                           ///< of the camera's gain feature
  bool use_chunks = true;
  bool count_frames = true;  ///< the camera numbers its frames without gaps: any other number is a fault

  int packet_size = 0;  ///< 0: the largest that passes, tried out
  std::int64_t packet_delay_ns = 0;
  bool packet_resend = true;
  bool packet_sockets = false;
  int socket_buffer_bytes = 4 << 20;
  std::chrono::microseconds packet_timeout{20'000}, frame_retention{100'000};
  int buffers = 4;

  std::string temperature_feature;                ///< empty: the first of the usual ones that it has
  std::string temperature_selector;               ///< "Sensor"; empty: as it stands
  std::chrono::milliseconds answer{1000};         ///< the longest that a call waits for the camera
  std::chrono::milliseconds open_within{10'000};  ///< when rigd starts

  /// Significant bits of the samples that are handed out.
  [[nodiscard]] int bits() const { return format.bits - shift_right; }
  /// "camera GV01", for messages.
  [[nodiscard]] std::string called() const { return "camera " + find; }
};

/// Errors are noted in the table.
[[nodiscard]] Settings read_settings(const base::ConfigTable& table);

/// A region, once the camera's own sizes are known, must keep the mosaic's phase.
[[nodiscard]] bool keeps_phase(const PixelFormat& format, int offset_x, int offset_y);

}  // namespace rig::drivers::aravis
