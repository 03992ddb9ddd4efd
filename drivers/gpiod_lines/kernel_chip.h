// A gpiochip of the kernel, through libgpiod 1.
#pragma once

#include "drivers/gpiod_lines/line_chip.h"

namespace rig::drivers::gpiod_lines {

/// `chip` is a label ("cp2112_gpio"), a name ("gpiochip0") or a path ("/dev/gpiochip0", or a link to that).
/// Two chips with one label are an error, as is a line that another program has.
[[nodiscard]] Result<std::unique_ptr<LineChip>> open_kernel_chip(const std::string& chip,
                                                                 const std::vector<LineRequest>& requests);

}  // namespace rig::drivers::gpiod_lines
