// Frame buffers that are made once. A slot belongs to whoever took it until it is released; clients on the
// same machine may look at it meanwhile and afterwards.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "daemon/event.h"
#include "protocol/frame_buffer.h"

namespace rig::daemon {

class FramePool {
 public:
  /// An Error where the system has not that much memory.
  [[nodiscard]] static base::Result<std::unique_ptr<FramePool>> make(std::size_t slots, std::size_t pixels);

  /// A free slot, with one holder; nothing where all are in use. Who looked at the frame before loses it.
  [[nodiscard]] std::optional<FrameSlot> take();
  void release(FrameSlot slot);
  [[nodiscard]] std::size_t slots() const { return buffers_.size(); }
  [[nodiscard]] std::size_t free_slots() const;
  [[nodiscard]] std::span<std::uint16_t> pixels(FrameSlot slot) const;
  [[nodiscard]] const protocol::FrameBuffer& buffer(FrameSlot slot) const;

 private:
  explicit FramePool(std::vector<protocol::FrameBuffer> buffers)
      : buffers_(std::move(buffers)), used_(buffers_.size(), false) {}
  mutable std::mutex mutex_;
  const std::vector<protocol::FrameBuffer> buffers_;
  std::vector<bool> used_;
  std::size_t next_ = 0;  // where the search begins: the slot that was free longest, for those who still look
};

}  // namespace rig::daemon
