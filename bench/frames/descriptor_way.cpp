#include <algorithm>
#include <array>
#include <optional>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "bench/frames/ways.h"
#include "protocol/frame_reader.h"

namespace rig::bench {

using base::ErrorCode;
using base::fail;
using base::Result;

namespace {

// What the client's process does; when it had seen the frame, or nothing where it was not the right one.
std::optional<Steady::time_point> see(const std::filesystem::path& socket, std::uint16_t value) {
  auto reader = protocol::FrameReader::connect(socket);
  if (!reader) return std::nullopt;
  const auto frame = reader->next(std::chrono::seconds(10));
  if (!frame || !*frame) return std::nullopt;
  const bool right =
      (*frame)->pixels.front() == value && (*frame)->pixels.back() == value && (*frame)->intact();
  const auto seen = Steady::now();
  return right ? std::optional(seen) : std::nullopt;
}

}  // namespace

Result<DescriptorWay> DescriptorWay::open(const std::filesystem::path& folder) {
  auto buffer = protocol::FrameBuffer::make(std::size_t{kWidth} * kHeight);
  if (!buffer) return base::pass(buffer);
  auto door = protocol::FrameDoor::open(folder);
  if (!door) return base::pass(door);
  return DescriptorWay(folder / "frames.sock", std::move(*buffer), std::move(*door));
}

Result<Steady::duration> DescriptorWay::pass(std::uint16_t value) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) return fail(ErrorCode::io, "no pipe");
  const pid_t client = ::fork();
  if (client == 0) {
    const auto seen = see(socket_, value);
    if (!seen || ::write(ends[1], &*seen, sizeof *seen) != sizeof *seen) ::_exit(1);
    ::_exit(0);
  }
  ::close(ends[1]);
  while (door_->clients() == 0) std::this_thread::yield();
  // Filled as by a camera, so that the memory is as warm as it is then.
  buffer_.begin();
  std::fill(buffer_.pixels().begin(), buffer_.pixels().end(), value);
  const auto complete = Steady::now();
  protocol::LocalFrame facts;
  facts.set_generation(buffer_.complete());
  facts.set_width(kWidth);
  facts.set_height(kHeight);
  door_->publish(facts, buffer_);
  Steady::time_point seen;
  const bool told = ::read(ends[0], &seen, sizeof seen) == sizeof seen;
  ::close(ends[0]);
  int status = 0;
  (void)::waitpid(client, &status, 0);
  door_->publish(facts, buffer_);  // finds that the client went
  if (!told) return fail(ErrorCode::damaged, "the client saw another frame, or none");
  return seen - complete;
}

}  // namespace rig::bench
