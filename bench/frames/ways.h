// Ways of a frame of 24 MiB to a client on the same machine, and how long each takes from the complete frame
// until the client has read its first and its last sample.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "bench/base/latencies.h"
#include "bench/indi/indi_peer.h"
#include "core/base/result.h"
#include "protocol/frame_door.h"
#include "tests/soak/rig_process.h"

namespace rig::bench {

inline constexpr std::uint32_t kWidth = 4096;
inline constexpr std::uint32_t kHeight = 3072;  // times 2 bytes: 24 MiB

/// rigd at work, taking such frames at the pace of the wall, and storing them: from when it has a frame
/// whole, by its own word (LocalFrame.complete_ns), to a client that connected for this frame and has mapped
/// it.
class RigdWay {
 public:
  /// Running and taking frames when this returns; it takes twice as many as are to be passed, for those that
  /// are taken while nobody looks.
  [[nodiscard]] static base::Result<RigdWay> open(const std::filesystem::path& folder, int frames);
  [[nodiscard]] base::Result<Steady::duration> pass();

 private:
  RigdWay(std::filesystem::path socket, soak::RigProcess process)
      : socket_(std::move(socket)), process_(std::move(process)) {}
  std::filesystem::path socket_;
  soak::RigProcess process_;
};

/// rigd's door alone: the descriptor of the memory is handed to a process that has mapped nothing before.
class DescriptorWay {
 public:
  [[nodiscard]] static base::Result<DescriptorWay> open(const std::filesystem::path& folder);
  [[nodiscard]] base::Result<Steady::duration> pass(std::uint16_t value);

 private:
  DescriptorWay(std::filesystem::path socket, protocol::FrameBuffer buffer,
                std::unique_ptr<protocol::FrameDoor> door)
      : socket_(std::move(socket)), buffer_(std::move(buffer)), door_(std::move(door)) {}
  std::filesystem::path socket_;
  protocol::FrameBuffer buffer_;
  std::unique_ptr<protocol::FrameDoor> door_;
};

/// The same bytes through a Unix stream socket, as they are: the least that a copy takes.
[[nodiscard]] base::Result<Steady::duration> copy_through_stream(std::uint16_t value);

/// INDI's: its camera simulator draws a frame of that size, its server sends it in base64 over TCP. Measured
/// from when the client has read the head of the BLOB, which the server sends once it has the whole frame:
/// the way from driver to server is not in it.
class IndiWay {
 public:
  [[nodiscard]] static base::Result<IndiWay> open(const std::filesystem::path& folder);
  [[nodiscard]] base::Result<Steady::duration> pass();

 private:
  explicit IndiWay(IndiPeer peer) : peer_(std::move(peer)) {}
  IndiPeer peer_;
};

}  // namespace rig::bench
