// One frame in memory that other processes can look at. rigd writes it; whoever has its descriptor reads it,
// and learns afterwards whether rigd has begun to write it anew meanwhile.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/result.h"

namespace rig::protocol {

/// The first bytes of the memory; the pixels begin at kPixelsAt.
struct FrameHeader {
  /// Odd while rigd writes the pixels; grows by 2 with each frame.
  std::atomic<std::uint64_t> generation;
};
inline constexpr std::size_t kPixelsAt = 4096;

class FrameBuffer {
 public:
  /// Memory of so many 16-bit samples, all of it present from the start, so that no frame waits for pages.
  [[nodiscard]] static base::Result<FrameBuffer> make(std::size_t samples);
  FrameBuffer(FrameBuffer&& other) noexcept;
  FrameBuffer& operator=(FrameBuffer&&) = delete;
  ~FrameBuffer();

  [[nodiscard]] std::span<std::uint16_t> pixels() const;
  /// Before the first pixel changes: those who look at the frame before lose it.
  void begin() const;
  /// After the last pixel; the generation that readers compare with.
  std::uint64_t complete() const;
  /// A descriptor that can be mapped for reading alone; it stays this object's.
  [[nodiscard]] int descriptor() const { return read_fd_; }

 private:
  FrameBuffer() = default;
  [[nodiscard]] FrameHeader& header() const { return *static_cast<FrameHeader*>(memory_); }
  void* memory_ = nullptr;
  std::size_t bytes_ = 0;
  int read_fd_ = -1;
};

}  // namespace rig::protocol
