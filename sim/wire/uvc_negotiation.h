// How host and simulated USB video camera agree on a stream: probe and commit (UVC 1.1, 4.3.1.1).
#pragma once

#include <array>

#include "sim/wire/usb.h"
#include "sim/wire/uvc_format.h"
#include "sim/wire/uvc_request.h"

namespace rig::sim::wire {

/// Bytes of a probe and of a commit in version 1.1.
inline constexpr std::size_t kUvcProbe = 34;

class UvcNegotiation {
 public:
  static constexpr std::uint8_t kProbeControl = 1, kCommitControl = 2;

  /// A class request for one of the two controls. A probe for what the camera has not is answered with what
  /// comes next: an unknown format or frame by the first, an interval by the nearest. A commit must be what
  /// the last probe said.
  [[nodiscard]] UvcReply answer(const SetupPacket& setup, std::span<const std::uint8_t> out);

  /// As of the last commit.
  [[nodiscard]] const UvcStreamChoice& committed() const { return committed_; }

 private:
  UvcStreamChoice probed_, committed_;
};

}  // namespace rig::sim::wire
