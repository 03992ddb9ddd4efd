// What a person or a test tells a simulated CP2112, a line each.
#pragma once

#include <string>
#include <string_view>

#include "core/base/result.h"
#include "sim/wire/cp2112.h"

namespace rig::sim::wire {

/// "drive PIN high|low|free", "stall COUNT": the text is empty. "show PIN": "input" or "output" and "high" or
/// "low".
[[nodiscard]] base::Result<std::string> carry_out_order(Cp2112& chip, std::string_view order);

}  // namespace rig::sim::wire
