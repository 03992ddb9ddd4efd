// A video device as the kernel offers it: requests with their structures of <linux/videodev2.h>, and buffers
// that are mapped. Two things can be behind it: a node in /dev, and for tests a socket.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "core/base/result.h"

namespace rig::drivers::v4l2 {

/// Memory that is shared with whoever fills it; unmapped at the end.
class Mapping {
 public:
  Mapping() = default;
  Mapping(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  Mapping(Mapping&& other) noexcept;
  Mapping& operator=(Mapping&& other) noexcept;
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping();

  [[nodiscard]] const std::uint8_t* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  const std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
};

class VideoNode {
 public:
  VideoNode() = default;
  VideoNode(const VideoNode&) = delete;
  VideoNode& operator=(const VideoNode&) = delete;
  virtual ~VideoNode() = default;

  /// One ioctl: 0, or the errno that it set. Never waits for a frame: VIDIOC_DQBUF answers EAGAIN.
  [[nodiscard]] virtual int request(unsigned long code, void* argument) = 0;
  /// A buffer, by the offset that VIDIOC_QUERYBUF told; an errno where it fails.
  [[nodiscard]] virtual tl::expected<Mapping, int> map(std::uint32_t offset, std::size_t length) = 0;

  /// From here on no other program may change it, where the device knows priorities. EBUSY: another has it
  /// so.
  [[nodiscard]] int claim();
  /// Another program has claimed it: it refuses whatever changes it.
  [[nodiscard]] bool is_claimed_by_another();

 private:
  bool claimed_ = false;
};

/// Devices with this in front are sockets.
inline constexpr const char* kSocketPrefix = "unix:";

/// `device` is the path of a node, "/dev/v4l/by-id/...", or "unix:" and the path of a socket. Errors: lost
/// (it is not there), io (it may not be opened).
[[nodiscard]] base::Result<std::unique_ptr<VideoNode>> open_node(const std::string& device);

}  // namespace rig::drivers::v4l2
