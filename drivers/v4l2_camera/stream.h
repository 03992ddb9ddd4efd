// The buffers of a video device that streams: mapped, queued, and taken when they are full.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "drivers/v4l2_camera/frame_sieve.h"
#include "drivers/v4l2_camera/settings.h"
#include "drivers/v4l2_camera/video_node.h"

namespace rig::drivers::v4l2 {

struct Filled {
  std::uint32_t index = 0;  ///< of the buffer, to give it back
  FrameFacts facts;
  std::span<const std::uint8_t> bytes;  ///< used; valid until the buffer is given back
};

/// Whatever fails while it streams is `lost`: opening it anew mends it, or says why not.
class Stream {
 public:
  /// Buffers for images of `bytes`; all are queued, and the camera runs. The node must outlive it.
  [[nodiscard]] static base::Result<std::unique_ptr<Stream>> start(VideoNode& node, const Settings& settings,
                                                                   std::size_t bytes, int buffers);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// A buffer that is full; nothing while none is. Does not wait.
  [[nodiscard]] base::Result<std::optional<Filled>> take();
  [[nodiscard]] base::Result<void> give_back(std::uint32_t index);
  [[nodiscard]] std::size_t buffers() const { return buffers_.size(); }

 private:
  Stream(VideoNode& node, Stamp stamp) : node_(node), stamp_(stamp) {}
  [[nodiscard]] base::Result<void> allocate(std::size_t bytes, int buffers);

  VideoNode& node_;
  const Stamp stamp_;
  bool running_ = false;
  std::vector<Mapping> buffers_;
};

}  // namespace rig::drivers::v4l2
