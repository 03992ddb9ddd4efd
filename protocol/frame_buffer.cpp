#include "protocol/frame_buffer.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <new>
#include <sys/mman.h>
#include <unistd.h>
#include <utility>

namespace rig::protocol {

using base::ErrorCode;
using base::fail;

base::Result<FrameBuffer> FrameBuffer::make(std::size_t samples) {
  FrameBuffer made;
  made.bytes_ = kPixelsAt + samples * sizeof(std::uint16_t);
  const int fd = ::memfd_create("rigd-frame", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  const auto failed = [&](const char* what) {
    const int error = errno;
    if (fd >= 0) ::close(fd);
    return fail(ErrorCode::io, fmt::format("{}: {}", what, std::strerror(error)), "memory of a frame");
  };
  if (fd < 0) return failed("cannot be made");
  if (::ftruncate(fd, static_cast<off_t>(made.bytes_)) != 0) return failed("cannot have that size");
  void* memory = ::mmap(nullptr, made.bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd, 0);
  if (memory == MAP_FAILED) return failed("cannot be mapped");
  made.memory_ = memory;
  new (memory) FrameHeader{};
  // Nobody else can write or resize it, however the descriptor is opened again.
  if (::fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL) != 0)
    return failed("cannot be sealed");
  made.read_fd_ = ::open(fmt::format("/proc/self/fd/{}", fd).c_str(), O_RDONLY | O_CLOEXEC);
  if (made.read_fd_ < 0) return failed("cannot be opened for reading");
  ::close(fd);
  return made;
}

FrameBuffer::FrameBuffer(FrameBuffer&& other) noexcept
    : memory_(std::exchange(other.memory_, nullptr)),
      bytes_(other.bytes_),
      read_fd_(std::exchange(other.read_fd_, -1)) {}

FrameBuffer::~FrameBuffer() {
  if (memory_ != nullptr) ::munmap(memory_, bytes_);
  if (read_fd_ >= 0) ::close(read_fd_);
}

std::span<std::uint16_t> FrameBuffer::pixels() const {
  auto* first = reinterpret_cast<std::uint16_t*>(static_cast<std::byte*>(memory_) + kPixelsAt);
  return {first, (bytes_ - kPixelsAt) / sizeof(std::uint16_t)};
}

void FrameBuffer::begin() const {
  // Taken and given back without a frame it is odd already.
  header().generation.fetch_or(1, std::memory_order_relaxed);
  // No pixel is written before readers can see it.
  std::atomic_thread_fence(std::memory_order_seq_cst);
}

std::uint64_t FrameBuffer::complete() const {
  return header().generation.fetch_add(1, std::memory_order_release) + 1;
}

}  // namespace rig::protocol
