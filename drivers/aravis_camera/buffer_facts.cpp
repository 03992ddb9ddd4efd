#include "drivers/aravis_camera/buffer_facts.h"

namespace rig::drivers::aravis {

namespace {

std::string damage_of(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_SUCCESS:
      return {};
    case ARV_BUFFER_STATUS_TIMEOUT:
      return "part of it never came";
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "a packet has a number that cannot be";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "it is larger than it should be";
    case ARV_BUFFER_STATUS_ABORTED:
      return "its transfer was ended";
    default:
      return "the receiver gives no reason";
  }
}

}  // namespace

BufferFacts facts_of(ArvBuffer* buffer, ArvChunkParser* chunks) {
  BufferFacts facts;
  facts.damage = damage_of(arv_buffer_get_status(buffer));
  facts.taken_ns = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
  if (!facts.damage.empty()) return facts;
  const ArvBufferPayloadType type = arv_buffer_get_payload_type(buffer);
  facts.is_image =
      arv_buffer_get_n_parts(buffer) == 1 &&
      (type == ARV_BUFFER_PAYLOAD_TYPE_IMAGE || type == ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA);
  if (!facts.is_image) return facts;
  facts.frame_id = arv_buffer_get_frame_id(buffer);
  facts.format = arv_buffer_get_image_pixel_format(buffer);
  arv_buffer_get_image_region(buffer, &facts.offset_x, &facts.offset_y, &facts.width, &facts.height);
  gint lines = 0;
  arv_buffer_get_image_padding(buffer, &facts.line_padding, &lines);
  (void)arv_buffer_get_image_data(buffer, &facts.bytes);
  if (chunks != nullptr) {
    Failed failed;
    const double us = arv_chunk_parser_get_float_value(chunks, buffer, "ChunkExposureTime", failed.slot());
    if (!failed) facts.exposure_s = us * 1e-6;
  }
  return facts;
}

}  // namespace rig::drivers::aravis
