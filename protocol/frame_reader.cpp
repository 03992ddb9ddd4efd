#include "protocol/frame_reader.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include <utility>

namespace rig::protocol {

using base::ErrorCode;
using base::fail;
using base::Result;

bool SeenFrame::intact() const {
  // Nothing of the pixels is read after the generation.
  std::atomic_thread_fence(std::memory_order_acquire);
  return header->generation.load(std::memory_order_relaxed) == facts.generation();
}

Result<FrameReader> FrameReader::connect(const std::filesystem::path& socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = socket.string();
  if (name.size() >= sizeof address.sun_path)
    return fail(ErrorCode::bad_input, "the path is too long for a socket", name);
  name.copy(address.sun_path, sizeof address.sun_path - 1);
  FrameReader reader(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  if (reader.fd_ < 0 ||
      ::connect(reader.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return fail(ErrorCode::io, fmt::format("cannot connect: {}", std::strerror(errno)), name,
                "rigd must run, and you must be in the group of the socket");
  }
  return reader;
}

FrameReader::FrameReader(FrameReader&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), mappings_(std::exchange(other.mappings_, {})) {}

FrameReader::~FrameReader() {
  for (const auto& [slot, mapping] : mappings_) ::munmap(mapping.memory, mapping.bytes);
  if (fd_ >= 0) ::close(fd_);
}

Result<FrameReader::Mapping> FrameReader::mapping_of(const LocalFrame& facts, int descriptor) {
  const std::size_t needed =
      kPixelsAt + std::size_t{facts.width()} * std::size_t{facts.height()} * sizeof(std::uint16_t);
  struct stat is {};
  if (::fstat(descriptor, &is) != 0 || static_cast<std::size_t>(is.st_size) < needed)
    return fail(ErrorCode::damaged, "the memory that rigd handed over is smaller than the frame it tells of");
  if (const auto known = mappings_.find(facts.slot()); known != mappings_.end()) {
    if (known->second.bytes < needed) return fail(ErrorCode::damaged, "rigd's memory of a frame has shrunk");
    return known->second;
  }
  const auto bytes = static_cast<std::size_t>(is.st_size);
  void* memory = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor, 0);
  if (memory == MAP_FAILED)
    return fail(ErrorCode::io, fmt::format("cannot map a frame: {}", std::strerror(errno)));
  return mappings_.emplace(facts.slot(), Mapping{memory, bytes}).first->second;
}

Result<std::optional<SeenFrame>> FrameReader::next(std::chrono::milliseconds timeout) {
  pollfd polled{fd_, POLLIN, 0};
  if (::poll(&polled, 1, static_cast<int>(timeout.count())) <= 0) return std::nullopt;
  std::array<char, 4096> bytes;
  iovec part{bytes.data(), bytes.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const auto got = ::recvmsg(fd_, &message, MSG_CMSG_CLOEXEC);
  if (got <= 0) return fail(ErrorCode::io, "rigd ended the connection", "frames.sock", "connect again");
  const cmsghdr* header = CMSG_FIRSTHDR(&message);
  if (header == nullptr || header->cmsg_type != SCM_RIGHTS)
    return fail(ErrorCode::damaged, "a frame came without its memory", "frames.sock");
  int descriptor = -1;
  std::memcpy(&descriptor, CMSG_DATA(header), sizeof descriptor);
  SeenFrame seen;
  const bool read = seen.facts.ParseFromArray(bytes.data(), static_cast<int>(got));
  auto mapping = read ? mapping_of(seen.facts, descriptor)
                      : Result<Mapping>(fail(ErrorCode::damaged, "is no LocalFrame", "frames.sock"));
  ::close(descriptor);
  if (!mapping) return base::pass(mapping);
  seen.header = static_cast<const FrameHeader*>(mapping->memory);
  seen.pixels = {
      reinterpret_cast<const std::uint16_t*>(static_cast<const std::byte*>(mapping->memory) + kPixelsAt),
      std::size_t{seen.facts.width()} * std::size_t{seen.facts.height()}};
  return std::optional(std::move(seen));
}

}  // namespace rig::protocol
