#include "drivers/v4l2_camera/socket_node.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <linux/ioctl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace rig::drivers::v4l2 {

using base::ErrorCode;
using base::fail;

namespace {

constexpr int kAnswer_ms = 2000;
constexpr std::size_t kLargest = 4096;

class SocketNode final : public VideoNode {
 public:
  explicit SocketNode(int fd) : fd_(fd) {}
  ~SocketNode() override { ::close(fd_); }
  SocketNode(const SocketNode&) = delete;
  SocketNode& operator=(const SocketNode&) = delete;

  [[nodiscard]] int request(unsigned long code, void* argument) override {
    const std::size_t size = _IOC_SIZE(code);
    std::array<std::uint8_t, kLargest> packet{};
    const auto number = static_cast<std::uint32_t>(code);
    if (size > packet.size() - sizeof number) return EINVAL;
    std::memcpy(packet.data(), &number, sizeof number);
    std::memcpy(packet.data() + sizeof number, argument, size);
    if (!send(packet.data(), sizeof number + size)) return ENODEV;
    int passed = -1;
    const auto came = receive(packet, passed);
    if (passed >= 0) ::close(passed);
    if (came != sizeof(std::int32_t) + size) return ENODEV;
    std::memcpy(argument, packet.data() + sizeof(std::int32_t), size);
    return error_in(packet);
  }

  [[nodiscard]] tl::expected<Mapping, int> map(std::uint32_t offset, std::size_t length) override {
    const std::array<std::uint32_t, 3> words{0, offset, static_cast<std::uint32_t>(length)};
    if (!send(words.data(), sizeof words)) return tl::unexpected<int>(ENODEV);
    std::array<std::uint8_t, kLargest> packet{};
    int passed = -1;
    const auto came = receive(packet, passed);
    int error = came == sizeof(std::int32_t) ? error_in(packet) : ENODEV;
    if (error == 0 && passed < 0) error = ENODEV;
    void* at = MAP_FAILED;
    if (error == 0) {
      at = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, passed, 0);
      if (at == MAP_FAILED) error = errno;
    }
    if (passed >= 0) ::close(passed);
    if (error != 0) return tl::unexpected<int>(error);
    return Mapping(static_cast<const std::uint8_t*>(at), length);
  }

 private:
  [[nodiscard]] bool send(const void* data, std::size_t size) const {
    return ::send(fd_, data, size, MSG_NOSIGNAL) == static_cast<ssize_t>(size);
  }

  [[nodiscard]] static int error_in(const std::array<std::uint8_t, kLargest>& packet) {
    std::int32_t error = 0;
    std::memcpy(&error, packet.data(), sizeof error);
    return error < 0 ? EIO : error;
  }

  // The bytes that came (0: none), and a descriptor, if one came with them.
  [[nodiscard]] std::size_t receive(std::array<std::uint8_t, kLargest>& packet, int& passed) const {
    pollfd wait{fd_, POLLIN, 0};
    int ready = 0;
    do {
      ready = ::poll(&wait, 1, kAnswer_ms);
    } while (ready < 0 && errno == EINTR);
    if (ready <= 0) return 0;
    iovec bytes{packet.data(), packet.size()};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> room{};
    msghdr message{};
    message.msg_iov = &bytes;
    message.msg_iovlen = 1;
    message.msg_control = room.data();
    message.msg_controllen = room.size();
    const ssize_t n = ::recvmsg(fd_, &message, MSG_CMSG_CLOEXEC);
    const cmsghdr* head = CMSG_FIRSTHDR(&message);
    if (n > 0 && head != nullptr && head->cmsg_level == SOL_SOCKET && head->cmsg_type == SCM_RIGHTS) {
      std::memcpy(&passed, CMSG_DATA(head), sizeof passed);
    }
    return n > 0 ? static_cast<std::size_t>(n) : 0;
  }

  const int fd_;
};

}  // namespace

base::Result<std::unique_ptr<VideoNode>> open_socket_node(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    return fail(ErrorCode::bad_input, "the path of the socket is empty or too long");
  }
  path.copy(address.sun_path, path.size());
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (fd < 0) return fail(ErrorCode::io, std::strerror(errno));
  auto node = std::make_unique<SocketNode>(fd);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return fail(ErrorCode::lost, fmt::format("nobody plays a camera there: {}", std::strerror(errno)));
  }
  return node;
}

}  // namespace rig::drivers::v4l2
