#include "drivers/tic_axis/socket_transport.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace rig::drivers::tic {

using base::ErrorCode;
using base::fail;
using base::pass;
using base::Result;
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;
using Bytes = std::vector<std::uint8_t>;

namespace {

constexpr std::size_t kTagBytes = 4;
constexpr std::size_t kMostBytes = 4096;
enum Status : std::uint8_t { kDone = 0, kStall = 1 };
// GET_DESCRIPTOR of the device, and of its strings in English.
constexpr std::uint8_t kStandardIn = 0x80, kGetDescriptor = 6;
constexpr std::uint16_t kDeviceDescriptor = 0x0100, kStringDescriptor = 0x0300, kEnglish = 0x0409;

std::uint8_t low(std::uint32_t value) {
  return static_cast<std::uint8_t>(value & 0xFFU);
}

class SocketTransport final : public Transport {
 public:
  SocketTransport(int fd, const std::string& path) : fd_(fd) { identity_.where = path; }
  ~SocketTransport() override { ::close(fd_); }
  SocketTransport(const SocketTransport&) = delete;
  SocketTransport& operator=(const SocketTransport&) = delete;

  [[nodiscard]] Result<void> control_out(const ControlRequest& request, milliseconds within) override {
    auto answer = transfer(request, 0, within);
    if (!answer) return pass(answer);
    return {};
  }
  [[nodiscard]] Result<Bytes> control_in(const ControlRequest& request, std::uint16_t length,
                                         milliseconds within) override {
    return transfer(request, length, within);
  }
  [[nodiscard]] const Identity& identity() const override { return identity_; }

  /// Reads the descriptors.
  [[nodiscard]] Result<void> meet(const RetryPolicy& policy, Deadline call_ends) {
    constexpr std::uint16_t kDeviceBytes = 18, kStringBytes = 255;
    const auto descriptor = [&](std::uint16_t value, std::uint16_t index, std::uint16_t length) {
      return with_retries(policy, call_ends, identity_.where, [&](Deadline answer_by) {
        const auto left = std::chrono::ceil<milliseconds>(answer_by - Steady::now());
        return control_in({kStandardIn, kGetDescriptor, value, index}, length, left);
      });
    };
    const auto device = descriptor(kDeviceDescriptor, 0, kDeviceBytes);
    if (!device) return pass(device);
    if (device->size() != kDeviceBytes)
      return fail(ErrorCode::damaged, "no device descriptor", identity_.where);
    const Bytes& d = *device;
    identity_.product = static_cast<std::uint16_t>(d[10] | (d[11] << 8U));
    identity_.firmware = static_cast<std::uint16_t>(d[12] | (d[13] << 8U));
    const auto text =
        descriptor(static_cast<std::uint16_t>(kStringDescriptor | d[16]), kEnglish, kStringBytes);
    if (!text) return pass(text);
    for (std::size_t i = 2; i + 1 < text->size(); i += 2) identity_.serial += static_cast<char>((*text)[i]);
    identity_.where = fmt::format("Tic {} at {}", identity_.serial, identity_.where);
    return {};
  }

 private:
  [[nodiscard]] tl::unexpected<base::Error> gone() const {
    return fail(ErrorCode::lost, "the Tic is gone", identity_.where);
  }

  [[nodiscard]] Result<Bytes> transfer(const ControlRequest& r, std::uint16_t length, milliseconds within) {
    const auto deadline = Steady::now() + within;
    ++tag_;
    const std::array<std::uint8_t, kTagBytes + 8> message{
        low(tag_),    low(tag_ >> 8U),    low(tag_ >> 16U), low(tag_ >> 24U),
        r.type,       r.request,          low(r.value),     low(r.value >> 8U),
        low(r.index), low(r.index >> 8U), low(length),      low(static_cast<std::uint32_t>(length) >> 8U)};
    if (::send(fd_, message.data(), message.size(), MSG_NOSIGNAL) < 0) return gone();
    while (true) {
      const auto left = std::chrono::ceil<milliseconds>(deadline - Steady::now()).count();
      pollfd wait{fd_, POLLIN, 0};
      const int ready = ::poll(&wait, 1, static_cast<int>(std::max<milliseconds::rep>(left, 0)));
      if (ready < 0 && errno == EINTR) continue;
      if (ready == 0) {
        return fail(ErrorCode::timeout, fmt::format("no answer within {} ms", within.count()),
                    identity_.where);
      }
      std::array<std::uint8_t, kMostBytes> buffer{};
      const ssize_t n = ::recv(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (n < 0 && (errno == EAGAIN || errno == EINTR)) continue;
      if (n <= 0) return gone();
      if (n <= static_cast<ssize_t>(kTagBytes) ||
          std::memcmp(buffer.data(), message.data(), kTagBytes) != 0) {
        continue;  // of a transfer that was given up
      }
      const std::uint8_t status = buffer[kTagBytes];
      if (status == kStall) return fail(ErrorCode::device, "the Tic refuses the request", identity_.where);
      if (status != kDone) return fail(ErrorCode::damaged, "an answer that is none", identity_.where);
      return Bytes(buffer.begin() + kTagBytes + 1, buffer.begin() + n);
    }
  }

  const int fd_;
  Identity identity_;
  std::uint32_t tag_ = 0;
};

}  // namespace

Result<std::unique_ptr<Transport>> open_socket(const std::string& path, const Place& place,
                                               const RetryPolicy& policy, Deadline call_ends) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path))
    return fail(ErrorCode::bad_input, "the path is too long", path);
  std::memcpy(address.sun_path, path.data(), path.size());
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (fd < 0) return fail(ErrorCode::io, std::strerror(errno), path);
  auto transport = std::make_unique<SocketTransport>(fd, path);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return fail(ErrorCode::lost, fmt::format("no Tic there: {}", std::strerror(errno)), path);
  }
  if (auto met = transport->meet(policy, call_ends); !met) return pass(met);
  if (!place.serial.empty() && transport->identity().serial != place.serial) {
    return fail(ErrorCode::lost, fmt::format("there is no Tic with serial {}", place.serial),
                transport->identity().where);
  }
  return transport;
}

}  // namespace rig::drivers::tic
