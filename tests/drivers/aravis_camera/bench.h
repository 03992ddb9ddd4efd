// The conformance bench of the driver: Aravis' simulated GigE Vision camera in a process of its own.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::drivers::aravis {

[[nodiscard]] std::unique_ptr<conformance::Bench> make_bench();

}  // namespace rig::drivers::aravis
