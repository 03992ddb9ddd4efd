// Measures after how many frames a camera shows a setting: sets it to and fro and looks at its frames.
#pragma once

#include <optional>

#include "core/base/result.h"
#include "drivers/v4l2_camera/configure.h"
#include "drivers/v4l2_camera/settings.h"
#include "drivers/v4l2_camera/stream.h"
#include "drivers/v4l2_camera/video_node.h"

namespace rig::drivers::v4l2 {

struct Measured {
  std::optional<int> frames;  ///< nothing: it could not be seen
  std::string why;            ///< then
};

/// Takes some 60 frames, and up to 200 where nothing can be seen. Leaves the controls anywhere. Errors: lost.
[[nodiscard]] base::Result<Measured> measure_settling(VideoNode& node, Stream& stream,
                                                      const Settings& settings, const Configured& made);

}  // namespace rig::drivers::v4l2
