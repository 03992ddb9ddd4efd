// A frame on its way to the host: payloads, each with a header (UVC 1.1, 2.4.3.3).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace rig::sim::wire {

struct UvcFrameHead {
  bool odd = false;             ///< the frame identifier, which alternates
  bool damaged = false;         ///< the error bit, from the middle of the frame on
  std::uint32_t taken = 0;      ///< when the exposure began, in ticks of the device's clock
  std::uint32_t sent = 0;       ///< now, by the same clock
  std::uint16_t bus_frame = 0;  ///< now, as the bus counts milliseconds
};

/// In order, the last with the end of the frame; none longer than `most`, the header included. An empty frame
/// is a header alone.
[[nodiscard]] std::vector<std::vector<std::uint8_t>> uvc_payloads(std::span<const std::uint8_t> frame,
                                                                  const UvcFrameHead& head, std::size_t most);

}  // namespace rig::sim::wire
