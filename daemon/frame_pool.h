// Frame buffers that are made once. A slot belongs to whoever took it until it is released.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "daemon/event.h"

namespace rig::daemon {

class FramePool {
 public:
  FramePool(std::size_t slots, std::size_t pixels);

  /// A free slot, with one holder; nothing where all are in use.
  [[nodiscard]] std::optional<FrameSlot> take();
  void release(FrameSlot slot);
  [[nodiscard]] std::span<std::uint16_t> pixels(FrameSlot slot);

 private:
  std::mutex mutex_;
  std::vector<std::vector<std::uint16_t>> buffers_;
  std::vector<bool> used_;
};

}  // namespace rig::daemon
