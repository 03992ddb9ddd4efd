// What rig.toml says of a module's lines.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/config.h"
#include "drivers/common/relay_light.h"
#include "drivers/gpiod_lines/line_chip.h"

namespace rig::drivers::gpiod_lines {

struct LineSettings {
  LineRequest request;
  std::int64_t debounce_ns = 0;   ///< of an input
  Rest at_exit = Rest::inactive;  ///< of an output
  std::int64_t pulse_ns = 0;      ///< of an output: longer than 0 for one that falls back by itself
  bool verify = true;             ///< of an output: it is read after it was set
};

struct LinesSettings {
  std::string chip;
  std::chrono::milliseconds poll{10};  ///< between two looks at inputs whose changes the chip does not tell
  std::vector<LineSettings> lines;     ///< inputs, then outputs
  std::optional<RelayLightSettings> light;
};

/// Mistakes are noted in the table.
[[nodiscard]] LinesSettings read_lines_settings(const base::ConfigTable& settings);

/// As rigd knows them, in the order of `lines`.
[[nodiscard]] std::vector<Line> lines_of(const LinesSettings& settings);

}  // namespace rig::drivers::gpiod_lines
