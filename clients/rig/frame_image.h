// A frame that rigd answered with, as an image file.
#pragma once

#include <string>

#include "core/base/result.h"
#include "protocol/rig.pb.h"

namespace rig::client {

enum class FrameContent { preview, raw };

/// What the name of a file says that it shall hold: .png the preview, .tif the raw samples (16 bits).
[[nodiscard]] base::Result<FrameContent> content_for(const std::string& path);

/// An Error unless the frame holds all pixels of the image that it says it has.
[[nodiscard]] base::Result<void> check_frame(const protocol::Frame& frame, FrameContent content);

/// Writes it durably, whole or not at all.
[[nodiscard]] base::Result<void> write_frame(const protocol::Frame& frame, FrameContent content,
                                             const std::string& path);

}  // namespace rig::client
