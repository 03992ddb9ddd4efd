#include "sim/wire/gvcp_resend.h"

#include <array>
#include <linux/filter.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace rig::sim::wire {

namespace {

constexpr std::uint16_t kGvcpPort = 3956;
constexpr std::uint8_t kKey = 0x42, kExtendedIds = 0x10;
constexpr std::uint16_t kPacketResend = 0x0040;
constexpr std::size_t kHeader = 8, kBody = 12, kUdpHeader = 8;
constexpr int kTurn_ms = 20;

std::uint32_t word(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value = (value << 8) | bytes[at + i];
  return value;
}

// On a busy interface the frames themselves would fill the socket. Offsets are from the header of IP.
bool hear_only_requests(int fd) {
  std::array<sock_filter, 7> steps{{BPF_STMT(BPF_LDX | BPF_B | BPF_MSH, 0),
                                    BPF_STMT(BPF_LD | BPF_H | BPF_IND, 2),
                                    BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kGvcpPort, 0, 3),
                                    BPF_STMT(BPF_LD | BPF_H | BPF_IND, kUdpHeader + 2),
                                    BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kPacketResend, 0, 1),
                                    BPF_STMT(BPF_RET | BPF_K, 0xffff), BPF_STMT(BPF_RET | BPF_K, 0)}};
  const sock_fprog program{steps.size(), steps.data()};
  return ::setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0;
}

}  // namespace

std::optional<ResendRequest> read_resend_request(std::span<const std::uint8_t> datagram) {
  if (datagram.size() != kHeader + kBody) return std::nullopt;
  const bool is_command = datagram[0] == kKey && (datagram[1] & kExtendedIds) == 0 &&
                          word(datagram, 2, 2) == kPacketResend && word(datagram, 4, 2) == kBody &&
                          word(datagram, 6, 2) != 0;
  const bool first_stream = word(datagram, kHeader, 2) == 0;
  if (!is_command || !first_stream) return std::nullopt;
  ResendRequest request;
  request.frame = static_cast<std::uint16_t>(word(datagram, kHeader + 2, 2));
  request.first = word(datagram, kHeader + 4, 4);
  request.last = word(datagram, kHeader + 8, 4);
  if (request.frame == 0 || request.first > request.last || request.last > kToTheEnd) return std::nullopt;
  return request;
}

std::unique_ptr<ResendEar> ResendEar::listen(in_addr camera, Asked asked) {
  const int fd = ::socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, IPPROTO_UDP);
  if (fd < 0) return nullptr;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr = camera;
  if (!hear_only_requests(fd) ||
      ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(fd);
    return nullptr;
  }
  return std::unique_ptr<ResendEar>(new ResendEar(fd, std::move(asked)));
}

ResendEar::ResendEar(int fd, Asked asked) : fd_(fd), asked_(std::move(asked)) {
  thread_ = std::thread([this] { hear(); });
}

ResendEar::~ResendEar() {
  ending_ = true;
  thread_.join();
  ::close(fd_);
}

void ResendEar::hear() {
  std::array<std::uint8_t, 1024> packet{};
  while (!ending_) {
    pollfd wait{fd_, POLLIN, 0};
    if (::poll(&wait, 1, kTurn_ms) <= 0) continue;
    const ssize_t n = ::recv(fd_, packet.data(), packet.size(), 0);
    const std::size_t headers = std::size_t{packet[0] & 0xfU} * 4 + kUdpHeader;
    if (n < 0 || static_cast<std::size_t>(n) < headers) continue;
    const std::span<const std::uint8_t> whole(packet.data(), static_cast<std::size_t>(n));
    if (const auto request = read_resend_request(whole.subspan(headers))) asked_(*request);
  }
}

}  // namespace rig::sim::wire
