// The module on its bench: the simulated drive at the other end of a simulated bus.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::drivers::cia402 {

[[nodiscard]] std::unique_ptr<conformance::Bench> make_bench();

}  // namespace rig::drivers::cia402
