// Frames for clients on the same machine: a socket that hands them descriptors of the memory that the camera
// filled. No pixel is copied, and nobody is waited for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/result.h"
#include "protocol/frame_buffer.h"
#include "protocol/rig.pb.h"

namespace rig::protocol {

class FrameDoor {
 public:
  /// Listens at `<folder>/frames.sock` (SEQPACKET, mode 0660) for a group; empty: that of this process. The
  /// caller has the folder (protocol::Server).
  [[nodiscard]] static base::Result<std::unique_ptr<FrameDoor>> open(const std::filesystem::path& folder,
                                                                     const std::string& group = "");
  ~FrameDoor();
  FrameDoor(const FrameDoor&) = delete;
  FrameDoor& operator=(const FrameDoor&) = delete;

  /// Tells every client of a frame that is complete. Any thread; never waits: a client that does not take
  /// what it was told misses this frame, and is told with the next how many it missed. `frame.missed` is set
  /// here.
  void publish(const LocalFrame& frame, const FrameBuffer& buffer);

  [[nodiscard]] std::size_t clients() const;

 private:
  struct State;
  explicit FrameDoor(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace rig::protocol
