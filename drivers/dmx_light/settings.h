// What rig.toml says of a light at a DMX widget.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/config.h"
#include "drivers/common/retry.h"
#include "drivers/common/serial_line.h"

namespace rig::drivers::dmx_light {

struct Channel {
  std::size_t number = 1;  ///< 1 is the first behind the start code
  std::uint8_t value = 0;
};

struct Shutter {
  std::size_t channel = 1;
  std::uint8_t open = 255, closed = 0;
};

struct DmxSettings {
  SerialSettings line;
  RetryPolicy retry;
  std::string serial;  ///< eight digits; empty: whichever is there first
  bool ask_names = false;
  std::size_t channels = 512;               ///< of a packet
  std::size_t level_channel = 1;            ///< all eight bits, or the upper ones
  std::optional<std::size_t> fine_channel;  ///< the lower eight bits
  std::optional<Shutter> shutter;
  std::vector<Channel> fixed;
  double at_start_level = 0, at_exit_level = 0;
  double warm_up_s = 0;
};

/// Mistakes are noted in the table.
[[nodiscard]] DmxSettings read_dmx_settings(const base::ConfigTable& settings);

}  // namespace rig::drivers::dmx_light
