#include "daemon/frame_pool.h"

#include <stdexcept>

namespace rig::daemon {

FramePool::FramePool(std::size_t slots, std::size_t pixels)
    : buffers_(slots, std::vector<std::uint16_t>(pixels)), used_(slots, false) {}

std::optional<FrameSlot> FramePool::take() {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < used_.size(); ++i) {
    if (used_[i]) continue;
    used_[i] = true;
    return FrameSlot{static_cast<int>(i)};
  }
  return std::nullopt;
}

void FramePool::release(FrameSlot slot) {
  const std::lock_guard lock(mutex_);
  const auto i = static_cast<std::size_t>(slot.index);
  // It may have a new holder already.
  if (!used_.at(i)) throw std::logic_error("a frame slot was released twice");
  used_[i] = false;
}

std::span<std::uint16_t> FramePool::pixels(FrameSlot slot) {
  return buffers_.at(static_cast<std::size_t>(slot.index));
}

}  // namespace rig::daemon
