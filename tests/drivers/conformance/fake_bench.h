// A bench with an axis, a camera, a light and lines, in simulated time, whose module is wrong as it is told.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"
#include "tests/drivers/conformance/flaws.h"

namespace rig::drivers::conformance {

[[nodiscard]] std::unique_ptr<Bench> make_fake_bench(Flaw flaw);

}  // namespace rig::drivers::conformance
