// The module tic_axis, as a shared object, against the Tic of sim/wire at this machine's USB. It needs root
// and the virtual USB host controller, which there is in the machine of tests/kernel.
#pragma once

#include <memory>

#include "drivers/conformance/bench.h"

namespace rig::drivers::tic::test {

/// Whether this machine has what the bench needs.
[[nodiscard]] bool has_virtual_usb();

/// Each bench plugs in a Tic with a serial number of its own.
[[nodiscard]] std::unique_ptr<conformance::Bench> make_usb_bench();

}  // namespace rig::drivers::tic::test
