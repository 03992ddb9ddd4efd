// The lines of one chip, for several readers.
//
// Inputs: an emergency stop, limit or home switches, a door. Outputs: relays, a shutter, a camera's trigger.
// A chip that vanishes is `lost` and opened again once a second; its outputs are then at their level of
// start, never at what was asked before. docs/drivers/gpiod_lines.md has wiring, settings and faults.
#pragma once

#include <memory>
#include <vector>

#include "core/base/clock.h"
#include "drivers/api/device.h"
#include "drivers/api/module.h"
#include "drivers/gpiod_lines/settings.h"

namespace rig::drivers::gpiod_lines {

class Lines;

/// Opens the chip. An error where it is not there, or a line is not to be had.
[[nodiscard]] Result<std::shared_ptr<Lines>> open_lines(const LinesSettings& settings, base::Clock& clock,
                                                        void (*log)(base::LogLevel, std::string_view));

/// A reader of its own: what its read() has seen of an input is taken from no other reader. All readers
/// belong to one worker. Once after the chip was away, a reader's read() is `lost`, also if it is back by
/// then. When the last reader is gone the outputs are at their level of exit.
[[nodiscard]] std::unique_ptr<DigitalIo> make_reader(std::shared_ptr<Lines> lines);

}  // namespace rig::drivers::gpiod_lines
