#include <array>
#include <cstddef>
#include <memory>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "bench/frames/ways.h"

namespace rig::bench {

using base::ErrorCode;
using base::fail;

base::Result<Steady::duration> copy_through_stream(std::uint16_t value) {
  const std::vector<std::uint16_t> pixels(std::size_t{kWidth} * kHeight, value);
  const std::size_t bytes = pixels.size() * sizeof pixels[0];
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return fail(ErrorCode::io, "no socket");
  Steady::time_point seen;
  bool right = false;
  std::thread client([&] {
    const auto memory = std::make_unique_for_overwrite<std::byte[]>(bytes);
    std::size_t got = 0;
    while (got < bytes) {
      const auto more = ::read(ends[1], memory.get() + got, bytes - got);
      if (more <= 0) return;
      got += static_cast<std::size_t>(more);
    }
    const auto* samples = reinterpret_cast<const std::uint16_t*>(memory.get());
    right = samples[0] == value && samples[bytes / sizeof value - 1] == value;
    seen = Steady::now();
  });
  const auto complete = Steady::now();
  const auto* from = reinterpret_cast<const std::byte*>(pixels.data());
  for (std::size_t sent = 0; sent < bytes;) {
    const auto more = ::write(ends[0], from + sent, bytes - sent);
    if (more <= 0) break;
    sent += static_cast<std::size_t>(more);
  }
  ::shutdown(ends[0], SHUT_WR);
  client.join();
  for (const int end : ends) ::close(end);
  if (!right) return fail(ErrorCode::damaged, "the client saw another frame");
  return seen - complete;
}

}  // namespace rig::bench
