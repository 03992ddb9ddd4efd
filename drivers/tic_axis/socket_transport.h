// Control transfers over a Unix socket, for tests on machines without a USB bus to plug into: a message is a
// tag of four bytes, the eight bytes of the setup packet and the data; its answer is that tag, a byte (0:
// done, 1: stall) and the data. The tag does what a USB host's own bookkeeping does: an answer to a transfer
// that was given up is dropped.
#pragma once

#include "drivers/tic_axis/transport.h"

namespace rig::drivers::tic {

/// `path` is that of a SOCK_SEQPACKET socket.
[[nodiscard]] base::Result<std::unique_ptr<Transport>> open_socket(const std::string& path,
                                                                   const Place& place,
                                                                   const RetryPolicy& policy,
                                                                   Deadline call_ends);

}  // namespace rig::drivers::tic
