// The stream of frames of one camera, and the few buffers that go round in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/result.h"
#include "drivers/aravis_camera/glib.h"
#include "drivers/aravis_camera/settings.h"

namespace rig::drivers::aravis {

class FrameStream {
 public:
  /// Takes the memory for all buffers, once; `camera` outlives this.
  FrameStream(ArvCamera* camera, const Settings& settings, std::size_t payload_bytes);
  ~FrameStream() { close(); }
  FrameStream(const FrameStream&) = delete;
  FrameStream& operator=(const FrameStream&) = delete;

  /// A new stream with every buffer in it. On GigE it has a socket of its own: what is still on its way to an
  /// earlier one never gets into this one.
  [[nodiscard]] base::Result<void> open();
  /// Ends it; none of its buffers may be outstanding.
  void close();

  /// A buffer that is done, well or not; nullptr: none. Each goes back with give_back() before the next.
  [[nodiscard]] ArvBuffer* pop();
  void give_back(ArvBuffer* buffer);

  /// Of the socket that open() made, as the kernel granted it, in bytes as asked for; 0: there is none, or it
  /// is not known.
  [[nodiscard]] int socket_buffer_bytes() const { return socket_buffer_; }
  /// Packets that came only when they were asked for again, of all streams since this was made (GigE).
  [[nodiscard]] std::uint64_t resent_packets() const;

 private:
  ArvCamera* const camera_;
  const Settings& settings_;
  std::vector<Owned<ArvBuffer>> buffers_;
  Owned<ArvStream> stream_;
  int socket_buffer_ = 0;
  std::uint64_t resent_before_ = 0;  // of the streams before this one
};

/// Sets the receive buffer of this process' UDP socket on a port, with the right to exceed the system's limit
/// where the process has it. What the kernel granted; 0: there is no such socket.
[[nodiscard]] int enlarge_socket(unsigned port, int bytes);

}  // namespace rig::drivers::aravis
