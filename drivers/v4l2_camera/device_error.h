// What the errno of a request means. The same number means one thing of a stream and another of a control.
#pragma once

#include <string>

#include "core/base/result.h"
#include "drivers/v4l2_camera/video_node.h"

namespace rig::drivers::v4l2 {

/// Of formats, buffers and the stream: gone or silent is `lost`, used by another program is `busy`, anything
/// else `device`. `what` it failed: "to start its stream".
[[nodiscard]] tl::unexpected<base::Error> failed_to(const std::string& what, int error);

/// Of a control, which a camera may refuse itself: gone or silent is `lost`, claimed by another program or
/// not ready `busy`, anything else `device`. Asks the node who has claimed it.
[[nodiscard]] tl::unexpected<base::Error> control_failed_to(VideoNode& node, const std::string& what,
                                                            int error);

}  // namespace rig::drivers::v4l2
