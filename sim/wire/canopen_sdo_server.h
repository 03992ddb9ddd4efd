// The SDO server of a CANopen device (CiA 301): expedited transfers both ways, segmented upload.
#pragma once

#include <linux/can.h>
#include <optional>

#include "sim/wire/canopen_dictionary.h"

namespace rig::sim::wire {

class CanopenSdoServer {
 public:
  CanopenSdoServer(int node, CanopenDictionary& dictionary)
      : node_(static_cast<canid_t>(node)), dictionary_(dictionary) {}

  /// The answer to a frame, where it asks something of this server. A frame that is not 8 bytes long asks
  /// nothing.
  [[nodiscard]] std::optional<can_frame> answer(const can_frame& frame);
  /// Forgets a transfer under way.
  void reset() { upload_.reset(); }

 private:
  struct Upload {
    std::uint16_t index;
    std::uint8_t sub;
    std::string bytes;
    std::size_t sent = 0;
    bool toggle = false;
  };

  [[nodiscard]] can_frame fresh(std::uint8_t command, std::uint16_t index, std::uint8_t sub) const;
  [[nodiscard]] can_frame abort(std::uint32_t code, std::uint16_t index, std::uint8_t sub);
  [[nodiscard]] can_frame begin_upload(std::uint16_t index, std::uint8_t sub);
  [[nodiscard]] can_frame next_segment(const can_frame& frame);
  [[nodiscard]] can_frame download(const can_frame& frame, std::uint16_t index, std::uint8_t sub);

  canid_t node_;
  CanopenDictionary& dictionary_;
  std::optional<Upload> upload_;
};

}  // namespace rig::sim::wire
