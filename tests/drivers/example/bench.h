// The example's module on a bench, with a Turner at the end of its line.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::drivers::turner {

[[nodiscard]] std::unique_ptr<conformance::Bench> make_bench();

}  // namespace rig::drivers::turner
