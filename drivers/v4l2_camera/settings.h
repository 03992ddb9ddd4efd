// [module.settings] of a camera on Video4Linux.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/config.h"
#include "drivers/common/camera_gain.h"
#include "drivers/v4l2_camera/pixel_format.h"

namespace rig::drivers::v4l2 {

/// What a frame's time stamp is of.
enum class Stamp { as_told, start, end };

struct Settings {
  std::string name = "camera";  ///< that the module gives the device
  std::string device;           ///< "/dev/v4l/by-id/...", or "unix:" and a socket
  bool exclusive = true;        ///< no other program may set it meanwhile

  PixelFormat format;
  int shift_right = 0;        ///< of samples, for a camera that puts fewer bits than 16 at the top
  int width = 0, height = 0;  ///< 0: as the camera has it
  std::vector<std::pair<std::string, std::int32_t>> controls;  ///< name and value, set in this order

  std::optional<double> fixed_exposure_s;  ///< the camera has no exposure control that is used
  std::optional<double> exposure_unit_s;   ///< of its exposure control; absent: as the kernel defines it
  std::optional<double> longest_exposure_s;
  std::optional<double> frame_interval_s;  ///< absent: as the camera has it
  std::string gain_control;                ///< name; empty: the analogue one, else the one
  GainScale gain;                          ///< of that control

  Stamp stamp = Stamp::as_told;
  bool measure_settling = true;
  int settle_frames = 4;                          ///< where it was not measured
  int settle_margin = 1;                          ///< frames more than were measured or stated
  int buffers = 0;                                ///< 0: as many as settling takes, and some
  std::chrono::milliseconds open_within{10'000};  ///< when rigd starts

  /// Significant bits of the samples that are handed out.
  [[nodiscard]] int bits() const { return format.bits - shift_right; }
  /// "camera /dev/video0", for messages.
  [[nodiscard]] std::string called() const { return "camera " + device; }
};

inline constexpr int kMostSettleFrames = 30;

/// Errors are noted in the table.
[[nodiscard]] Settings read_settings(const base::ConfigTable& table);

}  // namespace rig::drivers::v4l2
