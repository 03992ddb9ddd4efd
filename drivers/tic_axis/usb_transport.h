// A Tic on USB, through libusb.
#pragma once

#include "drivers/tic_axis/transport.h"

namespace rig::drivers::tic {

/// The Tic that `place` names; this process alone has it then.
[[nodiscard]] base::Result<std::unique_ptr<Transport>> open_usb(const Place& place, const RetryPolicy& policy,
                                                                Deadline call_ends);

}  // namespace rig::drivers::tic
