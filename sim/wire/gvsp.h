// Frames as GigE Vision's stream protocol (GVSP) sends them: a leader, the payload in packets, a trailer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace rig::sim::wire {

struct GvspFrame {
  std::uint16_t id = 1;  ///< never 0
  std::uint64_t timestamp_ns = 0;
  std::uint32_t pixel_format = 0;
  std::uint32_t width = 0, height = 0, offset_x = 0, offset_y = 0;
  bool has_chunks = false;  ///< the payload is image and chunks
  std::span<const std::uint8_t> payload;
};

using Packet = std::vector<std::uint8_t>;

/// All packets of a frame in their order; `packet_size` counts the headers of IP and UDP, as the camera's
/// register does.
[[nodiscard]] std::vector<Packet> gvsp_packets(const GvspFrame& frame, std::size_t packet_size);

/// The answer to a request for a packet that the camera has not, or no more: a header that says so.
[[nodiscard]] Packet unavailable_packet(std::uint16_t frame, std::uint32_t number);

/// Appends a chunk as GigE Vision lays it: the data, then its id and its length.
void append_chunk(std::vector<std::uint8_t>& payload, std::uint32_t id, std::span<const std::uint8_t> data);
/// The end of a chunk whose `length` bytes of data are there already.
void end_chunk(std::vector<std::uint8_t>& payload, std::uint32_t id, std::size_t length);
[[nodiscard]] std::vector<std::uint8_t> big_endian(std::uint64_t value, std::size_t bytes);

}  // namespace rig::sim::wire
