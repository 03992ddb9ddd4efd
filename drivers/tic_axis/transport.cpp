#include "drivers/tic_axis/transport.h"

#include "drivers/tic_axis/socket_transport.h"
#include "drivers/tic_axis/usb_transport.h"

namespace rig::drivers::tic {

base::Result<std::unique_ptr<Transport>> open_transport(const Place& place, const RetryPolicy& policy,
                                                        Deadline call_ends) {
  constexpr std::string_view kUnix = "unix:";
  if (place.transport.starts_with(kUnix))
    return open_socket(place.transport.substr(kUnix.size()), place, policy, call_ends);
  return open_usb(place, policy, call_ends);
}

}  // namespace rig::drivers::tic
