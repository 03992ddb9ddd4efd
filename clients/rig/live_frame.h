// One frame of `rig live`: what was seen, measured.
#pragma once

#include <optional>
#include <vector>

#include "calibration/fiducials/tag_finder.h"
#include "clients/rig/frame_image.h"
#include "clients/rig/live_measure.h"
#include "core/machine/rig_config.h"

namespace rig::client {

struct LiveFrame {
  FrameContent content = FrameContent::raw;  ///< on which it was measured
  bool from_memory = false;                  ///< rigd's own (local_frames.h); else through its socket
  double exposure_us = 0;
  Region region;  ///< of focus and clipping, pixels of what it was measured on
  double focus = 0;
  Exposed exposed;
  std::vector<int> fiducials;  ///< ids, ascending
};

/// Where the sample is in the image, by nominal geometry; nothing where an axis is not homed, so that nobody
/// knows.
[[nodiscard]] std::optional<std::vector<geometry::Vec2>> sample_in_image(const machine::RigConfig& rig,
                                                                         const protocol::Status& status);

/// `rig`: nothing where the machine is not known here; then black is 0, saturation full scale, and the region
/// the whole frame. An Error where the frame holds no such image, or one of another camera than `rig` has.
[[nodiscard]] base::Result<LiveFrame> measure_frame(const protocol::Frame& frame, FrameContent content,
                                                    const std::optional<machine::RigConfig>& rig,
                                                    const protocol::Status& status,
                                                    calibration::TagFinder& finder);

}  // namespace rig::client
