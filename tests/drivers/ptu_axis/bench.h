// The driver of pan-tilt units on its bench: the unit of sim/wire at the other end of a pseudo-terminal.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::drivers::ptu {

[[nodiscard]] std::unique_ptr<conformance::Bench> make_bench();

}  // namespace rig::drivers::ptu
