// The module tic_axis, as a shared object, against the Tic of sim/wire at a socket.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::drivers::tic::test {

[[nodiscard]] std::unique_ptr<conformance::Bench> make_bench();

}  // namespace rig::drivers::tic::test
