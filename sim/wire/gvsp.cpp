#include "sim/wire/gvsp.h"

#include <algorithm>

namespace rig::sim::wire {

namespace {

constexpr std::uint8_t kLeader = 1, kTrailer = 2, kPayload = 3;
constexpr std::uint64_t kImage = 0x0001, kImageWithChunks = 0x4001;
constexpr std::uint16_t kSuccess = 0, kPacketUnavailable = 0x800c;
constexpr std::size_t kHeaders = 20 + 8 + 8;  // IP, UDP, GVSP

void put(Packet& packet, std::uint64_t value, std::size_t bytes) {
  const auto wide = big_endian(value, bytes);
  packet.insert(packet.end(), wide.begin(), wide.end());
}

// Status, frame, kind and number of the packet.
Packet begin_packet(std::uint16_t frame, std::uint8_t kind, std::size_t number,
                    std::uint16_t status = kSuccess) {
  Packet packet;
  put(packet, status, 2);
  put(packet, frame, 2);
  put(packet, kind, 1);
  put(packet, number, 3);
  return packet;
}

}  // namespace

std::vector<std::uint8_t> big_endian(std::uint64_t value, std::size_t bytes) {
  std::vector<std::uint8_t> out(bytes);
  for (std::size_t i = 0; i < bytes; ++i) out[i] = static_cast<std::uint8_t>(value >> (8 * (bytes - 1 - i)));
  return out;
}

std::vector<Packet> gvsp_packets(const GvspFrame& frame, std::size_t packet_size) {
  const std::uint64_t type = frame.has_chunks ? kImageWithChunks : kImage;
  std::vector<Packet> packets;
  Packet leader = begin_packet(frame.id, kLeader, 0);
  put(leader, 0, 2);
  put(leader, type, 2);
  put(leader, frame.timestamp_ns, 8);
  for (const std::uint32_t word :
       {frame.pixel_format, frame.width, frame.height, frame.offset_x, frame.offset_y}) {
    put(leader, word, 4);
  }
  put(leader, 0, 4);  // padding of lines and of the image
  packets.push_back(std::move(leader));
  const std::size_t room = packet_size - kHeaders;
  for (std::size_t at = 0; at < frame.payload.size(); at += room) {
    Packet packet = begin_packet(frame.id, kPayload, packets.size());
    const auto part = frame.payload.subspan(at, std::min(room, frame.payload.size() - at));
    packet.insert(packet.end(), part.begin(), part.end());
    packets.push_back(std::move(packet));
  }
  Packet trailer = begin_packet(frame.id, kTrailer, packets.size());
  put(trailer, 0, 2);
  put(trailer, type, 2);
  put(trailer, frame.height, 4);
  packets.push_back(std::move(trailer));
  return packets;
}

Packet unavailable_packet(std::uint16_t frame, std::uint32_t number) {
  return begin_packet(frame, kPayload, number, kPacketUnavailable);
}

void append_chunk(std::vector<std::uint8_t>& payload, std::uint32_t id, std::span<const std::uint8_t> data) {
  payload.insert(payload.end(), data.begin(), data.end());
  end_chunk(payload, id, data.size());
}

void end_chunk(std::vector<std::uint8_t>& payload, std::uint32_t id, std::size_t length) {
  put(payload, id, 4);
  put(payload, length, 4);
}

}  // namespace rig::sim::wire
