// The virtual rig's module on a bench. Its peers look at the world through the file that it is remembered in,
// not through the module.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::sim {

[[nodiscard]] std::unique_ptr<drivers::conformance::Bench> make_bench();

}  // namespace rig::sim
