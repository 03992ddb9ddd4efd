// A frame of 24 MiB, from "complete" to "a client has mapped it and read its first and its last byte": the
// descriptor that rigd hands over, beside a copy through a Unix stream socket. The bound is 1 ms; the ratio
// is that of the times.
#include <benchmark/benchmark.h>
#include <filesystem>
#include <memory>
#include <optional>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "protocol/frame_door.h"
#include "protocol/frame_reader.h"

namespace {

using namespace rig::protocol;
using Steady = std::chrono::steady_clock;

constexpr std::uint32_t kWidth = 4096;
constexpr std::uint32_t kHeight = 3072;  // times 2 bytes: 24 MiB

// Fills the memory as a camera does, so that it is as warm as it is then.
void expose(std::span<std::uint16_t> pixels, std::uint16_t value) {
  std::fill(pixels.begin(), pixels.end(), value);
}

void descriptor_passed(benchmark::State& state) {
  std::string pattern = (std::filesystem::temp_directory_path() / "rigd-bench-XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(pattern.data());
  {
    const auto buffer = FrameBuffer::make(std::size_t{kWidth} * kHeight);
    const auto door = FrameDoor::open(folder);
    std::uint16_t value = 0;
    for (auto _ : state) {
      // A client of its own each time: nothing is mapped yet.
      std::optional<FrameReader> reader(std::move(*FrameReader::connect(folder / "frames.sock")));
      while ((*door)->clients() == 0) std::this_thread::yield();
      buffer->begin();
      expose(buffer->pixels(), ++value);
      Steady::time_point seen;
      bool right = false;
      std::thread client([&] {
        const auto frame = reader->next(std::chrono::seconds(10));
        right = (*frame)->pixels.front() == value && (*frame)->pixels.back() == value && (*frame)->intact();
        seen = Steady::now();
      });
      const auto complete = Steady::now();
      LocalFrame facts;
      facts.set_generation(buffer->complete());
      facts.set_width(kWidth);
      facts.set_height(kHeight);
      (*door)->publish(facts, *buffer);
      client.join();
      if (!right) state.SkipWithError("the client saw another frame");
      state.SetIterationTime(std::chrono::duration<double>(seen - complete).count());
      reader.reset();
      (*door)->publish(facts, *buffer);  // finds that it went
    }
  }
  std::filesystem::remove_all(folder);
}

void copied_through_a_stream(benchmark::State& state) {
  std::vector<std::uint16_t> pixels(std::size_t{kWidth} * kHeight);
  const std::size_t bytes = pixels.size() * sizeof pixels[0];
  std::uint16_t value = 0;
  for (auto _ : state) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      return state.SkipWithError("no socket");
    expose(pixels, ++value);
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
      const auto* first = reinterpret_cast<const std::uint16_t*>(memory.get());
      right = first[0] == value && first[bytes / 2 - 1] == value;
      seen = Steady::now();
    });
    const auto complete = Steady::now();
    const auto* from = reinterpret_cast<const std::byte*>(pixels.data());
    for (std::size_t sent = 0; sent < bytes;) {
      const auto more = ::write(ends[0], from + sent, bytes - sent);
      if (more <= 0) break;
      sent += static_cast<std::size_t>(more);
    }
    client.join();
    if (!right) state.SkipWithError("the client saw another frame");
    state.SetIterationTime(std::chrono::duration<double>(seen - complete).count());
    ::close(ends[0]);
    ::close(ends[1]);
  }
}

BENCHMARK(descriptor_passed)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(100);
BENCHMARK(copied_through_a_stream)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(100);

}  // namespace
