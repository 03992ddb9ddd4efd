// For inputs whose chip does not tell of changes, or cannot be trusted to: somebody who looks at them all the
// time in its place.
#pragma once

#include <chrono>

#include "drivers/gpiod_lines/line_chip.h"

namespace rig::drivers::gpiod_lines {

/// The same chip, with changes of the inputs that were requested without edges: a thread of its own looks at
/// them once in `every`. What is shorter may be missed. A look that fails is what edges() of that input
/// answers from then on. The chip itself where there is no such input.
[[nodiscard]] std::unique_ptr<LineChip> poll_inputs(std::unique_ptr<LineChip> chip,
                                                    const std::vector<LineRequest>& requests,
                                                    std::chrono::milliseconds every);

}  // namespace rig::drivers::gpiod_lines
