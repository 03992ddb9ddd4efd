// The format and the frame interval of a video device.
#pragma once

#include "core/base/result.h"
#include "drivers/v4l2_camera/settings.h"
#include "drivers/v4l2_camera/video_node.h"

namespace rig::drivers::v4l2 {

/// Sets pixel format and size; a device that takes others instead is an error that says what it has.
[[nodiscard]] base::Result<Layout> set_format(VideoNode& node, const Settings& settings);

/// The interval between two frames, after it was set where the settings say one.
[[nodiscard]] base::Result<double> set_interval(VideoNode& node, const Settings& settings);

}  // namespace rig::drivers::v4l2
