// The format and the buffers of a simulated video device: what the kernel's ioctls of streaming do, and its
// errors.
#pragma once

#include <cstdint>
#include <deque>
#include <linux/videodev2.h>
#include <vector>

#include "sim/wire/v4l2_formats.h"

namespace rig::sim::wire {

class V4l2Queue {
 public:
  struct Size {
    std::uint32_t width = 0, height = 0;
  };
  V4l2Queue(std::vector<Size> sizes, std::uint32_t padding);
  ~V4l2Queue();
  V4l2Queue(const V4l2Queue&) = delete;
  V4l2Queue& operator=(const V4l2Queue&) = delete;

  /// Each answers 0 or the errno that the kernel would set.
  [[nodiscard]] static int list_format(v4l2_fmtdesc& about);
  [[nodiscard]] int get_format(v4l2_format& format) const;
  [[nodiscard]] int set_format(v4l2_format& format);
  [[nodiscard]] int make_buffers(v4l2_requestbuffers& request);
  [[nodiscard]] int describe(v4l2_buffer& buffer) const;
  [[nodiscard]] int queue(v4l2_buffer& buffer);
  [[nodiscard]] int dequeue(v4l2_buffer& buffer);
  [[nodiscard]] int start(std::uint32_t type);
  [[nodiscard]] int stop(std::uint32_t type);
  /// The memory of a buffer, by the offset that describe() told; -1: none. Stays the queue's.
  [[nodiscard]] int memory_at(std::uint32_t offset) const;

  [[nodiscard]] bool is_streaming() const { return streaming_; }
  [[nodiscard]] const VideoFormat& format() const { return *format_; }
  [[nodiscard]] const v4l2_pix_format& image() const { return image_; }

  struct Frame {
    std::uint32_t sequence = 0;
    std::uint32_t flags = 0;  ///< besides those of the buffer
    std::int64_t stamp_ns = 0;
    std::uint32_t bytes = 0;
  };
  /// The memory that the next frame goes to; nullptr: no buffer is queued, and the frame is dropped.
  [[nodiscard]] std::uint8_t* next_memory();
  void fill(const Frame& frame);

 private:
  enum class At { program, queued, done };
  struct Buffer {
    int memory = -1;
    std::uint8_t* bytes = nullptr;
    At at = At::program;
    Frame frame;
  };
  void fit(v4l2_pix_format& image) const;
  [[nodiscard]] v4l2_buffer described(std::uint32_t index) const;
  void free_buffers();

  const std::vector<Size> sizes_;
  const std::uint32_t padding_;
  const VideoFormat* format_;
  v4l2_pix_format image_{};
  std::vector<Buffer> buffers_;
  std::deque<std::uint32_t> queued_, done_;
  bool streaming_ = false;
};

}  // namespace rig::sim::wire
