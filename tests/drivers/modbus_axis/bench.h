// The module on the bench of the conformance suite: against the Leadshine drive over a serial line, and
// against the Oriental Motor drive over TCP.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::drivers::modbus {

[[nodiscard]] std::unique_ptr<conformance::Bench> make_rtu_bench();
[[nodiscard]] std::unique_ptr<conformance::Bench> make_tcp_bench();

}  // namespace rig::drivers::modbus
