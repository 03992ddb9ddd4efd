// The far end of a USB/IP connection, written by hand: what the kernel's virtual host controller sends.
#pragma once

#include <chrono>
#include <cstdint>
#include <gtest/gtest.h>
#include <memory>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <vector>

#include "sim/wire/usbip_device.h"

namespace rig::sim::wire::test {

using Bytes = std::vector<std::uint8_t>;

inline void put32(Bytes& b, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) b.push_back(static_cast<std::uint8_t>(value >> shift));
}
inline std::uint32_t get32(const Bytes& b, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = (value << 8) | b.at(at + i);
  return value;
}

class Host {
 public:
  explicit Host(ControlHandler control, UsbIpDevice::OutHandler out = {}) {
    std::array<int, 2> ends{};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), 0);
    fd_ = ends[0];
    device = std::make_unique<UsbIpDevice>(ends[1], std::move(control), std::move(out));
  }
  ~Host() { ::close(fd_); }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  void send(const Bytes& bytes) const {
    EXPECT_EQ(::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  // CMD_SUBMIT as the kernel packs it.
  void submit(std::uint32_t number, bool in, std::uint32_t endpoint, std::uint32_t length,
              const Bytes& setup = Bytes(8), const Bytes& data = {}, std::uint32_t packets = 0) const {
    Bytes b;
    for (const std::uint32_t word : {1U, number, 0x10001U, in ? 1U : 0U, endpoint}) put32(b, word);
    for (const std::uint32_t word : {0U, length, 0U, packets, 0U}) put32(b, word);
    b.insert(b.end(), setup.begin(), setup.end());
    b.insert(b.end(), data.begin(), data.end());
    send(b);
  }
  void unlink(std::uint32_t number, std::uint32_t of) const {
    Bytes b;
    for (const std::uint32_t word : {2U, number, 0x10001U, 0U, 0U, of}) put32(b, word);
    b.resize(48);
    send(b);
  }
  // So many bytes, or as many as come before the far end hangs up or is silent for two seconds.
  [[nodiscard]] Bytes receive(std::size_t count) const {
    Bytes got(count);
    std::size_t have = 0;
    while (have < count) {
      pollfd wait{fd_, POLLIN, 0};
      if (::poll(&wait, 1, 2000) <= 0) break;
      const ssize_t n = ::recv(fd_, got.data() + have, count - have, 0);
      if (n <= 0) break;
      have += static_cast<std::size_t>(n);
    }
    got.resize(have);
    return got;
  }
  [[nodiscard]] bool silent(std::chrono::milliseconds how_long) const {
    pollfd wait{fd_, POLLIN, 0};
    return ::poll(&wait, 1, static_cast<int>(how_long.count())) == 0;
  }
  struct Return {
    std::uint32_t command = 0, number = 0;
    std::int32_t status = 0;
    std::uint32_t length = 0;
    Bytes data;
  };
  [[nodiscard]] Return answer(bool in) const {
    const Bytes header = receive(48);
    if (header.size() != 48) {
      ADD_FAILURE() << header.size() << " bytes of a header";
      return {};
    }
    Return r{get32(header, 0),
             get32(header, 4),
             static_cast<std::int32_t>(get32(header, 20)),
             get32(header, 24),
             {}};
    // The host must find device, direction and endpoint empty.
    EXPECT_EQ(get32(header, 8) | get32(header, 12) | get32(header, 16), 0U);
    if (in && r.command == 3) r.data = receive(r.length);
    return r;
  }

  std::unique_ptr<UsbIpDevice> device;

 private:
  int fd_ = -1;
};

}  // namespace rig::sim::wire::test
