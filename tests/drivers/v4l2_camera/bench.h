// The conformance bench of the driver: a simulated video device behind a socket.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::drivers::v4l2 {

[[nodiscard]] std::unique_ptr<conformance::Bench> make_bench();

}  // namespace rig::drivers::v4l2
