// Makes a video device what the settings say, and finds out what it then can do.
#pragma once

#include <optional>
#include <string>

#include "core/base/result.h"
#include "drivers/common/camera_module.h"
#include "drivers/v4l2_camera/controls.h"
#include "drivers/v4l2_camera/settings.h"
#include "drivers/v4l2_camera/video_node.h"

namespace rig::drivers::v4l2 {

using Log = CameraLog;

/// A control of the exposure, and seconds of one of its counts.
struct ExposureControl {
  Control control;
  double unit_s = 100e-6;
};

struct Configured {
  std::string card;  ///< what the camera calls itself, and where it is plugged in
  Layout layout;
  std::size_t image_bytes = 0;
  std::optional<ExposureControl> exposure;  ///< nothing: it is fixed
  double min_exposure_s = 0, max_exposure_s = 0;
  std::optional<Control> gain;
  double interval_s = 0;  ///< between two frames that are exposed shortly
};

/// Errors: bad_input (it has no such format, size or control: what it has is said), busy (another program
/// streams from it), device, lost.
[[nodiscard]] base::Result<Configured> configure(VideoNode& node, const Settings& settings, const Log& log);

}  // namespace rig::drivers::v4l2
