#include "daemon/frame_pool.h"

#include <algorithm>
#include <stdexcept>

namespace rig::daemon {

base::Result<std::unique_ptr<FramePool>> FramePool::make(std::size_t slots, std::size_t pixels) {
  std::vector<protocol::FrameBuffer> buffers;
  for (std::size_t i = 0; i < slots; ++i) {
    auto buffer = protocol::FrameBuffer::make(pixels);
    if (!buffer) return base::pass(buffer);
    buffers.push_back(std::move(*buffer));
  }
  return std::unique_ptr<FramePool>(new FramePool(std::move(buffers)));
}

std::optional<FrameSlot> FramePool::take() {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < used_.size(); ++i) {
    const std::size_t slot = (next_ + i) % used_.size();
    if (used_[slot]) continue;
    used_[slot] = true;
    next_ = (slot + 1) % used_.size();
    buffers_[slot].begin();
    return FrameSlot{static_cast<int>(slot)};
  }
  return std::nullopt;
}

std::size_t FramePool::free_slots() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(std::count(used_.begin(), used_.end(), false));
}

void FramePool::release(FrameSlot slot) {
  const std::lock_guard lock(mutex_);
  const auto i = static_cast<std::size_t>(slot.index);
  // It may have a new holder already.
  if (!used_.at(i)) throw std::logic_error("a frame slot was released twice");
  used_[i] = false;
}

std::span<std::uint16_t> FramePool::pixels(FrameSlot slot) const {
  return buffer(slot).pixels();
}

const protocol::FrameBuffer& FramePool::buffer(FrameSlot slot) const {
  return buffers_.at(static_cast<std::size_t>(slot.index));
}

}  // namespace rig::daemon
