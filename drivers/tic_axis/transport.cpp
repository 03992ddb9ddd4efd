#include "drivers/tic_axis/transport.h"

#include "drivers/tic_axis/socket_transport.h"
#include "drivers/tic_axis/usb_transport.h"

namespace rig::drivers::tic {

base::Result<std::unique_ptr<Transport>> open_transport(const Place& place,
                                                        std::chrono::milliseconds within) {
  constexpr std::string_view kUnix = "unix:";
  if (place.transport.starts_with(kUnix))
    return open_socket(place.transport.substr(kUnix.size()), place, within);
  return open_usb(place);
}

}  // namespace rig::drivers::tic
