#include "drivers/cia402_axis/can_bus.h"

#include <cerrno>
#include <cstring>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <string_view>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <vector>

namespace rig::drivers::cia402 {

using base::ErrorCode;
using base::fail;
using base::Result;
using std::chrono::milliseconds;

namespace {

constexpr std::string_view kUnix = "unix:";
// A full queue of a CAN interface wakes nobody when it has room again.
constexpr milliseconds kLookAgain{1};

int milliseconds_until(Steady::time_point deadline) {
  const auto left = std::chrono::ceil<milliseconds>(deadline - Steady::now()).count();
  return static_cast<int>(std::max<milliseconds::rep>(left, 0));
}

// Closes what a failed opening leaves behind.
struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  int release() { return std::exchange(fd, -1); }
};

Result<int> open_socketcan(const std::string& interface, std::span<const canid_t> heard) {
  const auto failed = [&](const char* what, const char* hint) {
    return fail(ErrorCode::lost, fmt::format("{}: {}", what, std::strerror(errno)), interface, hint);
  };
  Descriptor socket{::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW)};
  if (socket.fd < 0) return failed("this system has no CAN sockets", "load the kernel module can_raw");
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  if (address.can_ifindex == 0) return failed("there is no such interface", "see 'ip -brief link'");
  std::vector<can_filter> filters;
  for (const canid_t id : heard) filters.push_back({id, CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_SFF_MASK});
  const can_err_mask_t errors = CAN_ERR_MASK;
  if (::setsockopt(socket.fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                   static_cast<socklen_t>(filters.size() * sizeof(can_filter))) != 0 ||
      ::setsockopt(socket.fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) != 0 ||
      ::bind(socket.fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return failed("the interface cannot be listened to", "is it a CAN interface?");
  }
  return socket.release();
}

Result<int> open_unix(const std::string& interface) {
  const std::string path = interface.substr(kUnix.size());
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    return fail(ErrorCode::bad_input, "a path has to follow, of at most 107 bytes", interface);
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  Descriptor socket{::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)};
  if (socket.fd < 0 ||
      ::connect(socket.fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return fail(ErrorCode::lost, fmt::format("nobody serves this socket: {}", std::strerror(errno)),
                interface);
  }
  return socket.release();
}

}  // namespace

Result<std::unique_ptr<CanBus>> CanBus::open(const std::string& interface, std::span<const canid_t> heard) {
  const bool is_unix = std::string_view(interface).starts_with(kUnix);
  const auto fd = is_unix ? open_unix(interface) : open_socketcan(interface, heard);
  if (!fd) return base::pass(fd);
  return std::unique_ptr<CanBus>(new CanBus(interface, *fd));
}

CanBus::~CanBus() {
  ::close(fd_);
}

Result<void> CanBus::write(const can_frame& frame, Steady::time_point deadline) {
  while (true) {
    if (::send(fd_, &frame, sizeof frame, MSG_NOSIGNAL) == sizeof frame) return {};
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != ENOBUFS) {
      return fail(ErrorCode::lost, fmt::format("no frame can be sent: {}", std::strerror(errno)), interface_,
                  "is the interface up?");
    }
    if (Steady::now() >= deadline) {
      return fail(ErrorCode::timeout, "the interface does not get rid of its frames", interface_,
                  "is anything else on the bus, and the bit rate right?");
    }
    (void)::poll(nullptr, 0, static_cast<int>(kLookAgain.count()));
  }
}

Result<std::optional<can_frame>> CanBus::read(Steady::time_point deadline) {
  while (true) {
    can_frame frame{};
    const ssize_t n = ::recv(fd_, &frame, sizeof frame, MSG_TRUNC);
    if (n == sizeof frame) return frame;
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
      return fail(ErrorCode::lost,
                  fmt::format("the interface is gone: {}", n == 0 ? "hung up" : std::strerror(errno)),
                  interface_, "is it up?");
    }
    // What is no classic frame is nobody's answer.
    if (n > 0 || errno == EINTR) continue;
    const int left_ms = milliseconds_until(deadline);
    if (left_ms == 0) return std::nullopt;
    pollfd wait{fd_, POLLIN, 0};
    (void)::poll(&wait, 1, left_ms);
  }
}

}  // namespace rig::drivers::cia402
