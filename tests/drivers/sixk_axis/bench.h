// The driver of 6000 controllers on its bench: the controller of sim/wire at the other end of a
// pseudo-terminal.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::drivers::sixk {

[[nodiscard]] std::unique_ptr<conformance::Bench> make_bench();

}  // namespace rig::drivers::sixk
