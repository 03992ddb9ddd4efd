#include "drivers/v4l2_camera/video_node.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>
#include <utility>

#include "drivers/v4l2_camera/socket_node.h"

namespace rig::drivers::v4l2 {

using base::ErrorCode;
using base::fail;

namespace {

class KernelNode final : public VideoNode {
 public:
  explicit KernelNode(int fd) : fd_(fd) {}
  ~KernelNode() override { ::close(fd_); }
  KernelNode(const KernelNode&) = delete;
  KernelNode& operator=(const KernelNode&) = delete;

  [[nodiscard]] int request(unsigned long code, void* argument) override {
    while (::ioctl(fd_, code, argument) != 0) {
      if (errno != EINTR) return errno;
    }
    return 0;
  }

  [[nodiscard]] tl::expected<Mapping, int> map(std::uint32_t offset, std::size_t length) override {
    void* at = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, fd_, offset);
    if (at == MAP_FAILED) return tl::unexpected<int>(errno);
    return Mapping(static_cast<const std::uint8_t*>(at), length);
  }

 private:
  const int fd_;
};

}  // namespace

Mapping::Mapping(Mapping&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

Mapping& Mapping::operator=(Mapping&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

Mapping::~Mapping() {
  if (data_ != nullptr) ::munmap(const_cast<std::uint8_t*>(data_), size_);
}

base::Result<std::unique_ptr<VideoNode>> open_node(const std::string& device) {
  const std::string_view prefix = kSocketPrefix;
  if (device.starts_with(prefix)) return open_socket_node(device.substr(prefix.size()));
  int fd = -1;
  do {
    fd = ::open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  } while (fd < 0 && errno == EINTR);
  if (fd >= 0) return std::make_unique<KernelNode>(fd);
  if (errno == EACCES || errno == EPERM) {
    return fail(ErrorCode::io, "rigd may not open it", {}, "the node's group must be one of rigd's: video");
  }
  // A node can be named a moment before it can be opened, and after it can.
  return fail(ErrorCode::lost, fmt::format("it is not there: {}", std::strerror(errno)));
}

int VideoNode::claim() {
  std::uint32_t priority = V4L2_PRIORITY_RECORD;  // there is none above it
  const int error = request(VIDIOC_S_PRIORITY, &priority);
  if (error == 0) claimed_ = true;
  return error;
}

bool VideoNode::is_claimed_by_another() {
  std::uint32_t highest = V4L2_PRIORITY_UNSET;
  return !claimed_ && request(VIDIOC_G_PRIORITY, &highest) == 0 && highest > V4L2_PRIORITY_DEFAULT;
}

}  // namespace rig::drivers::v4l2
