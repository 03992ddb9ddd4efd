// Bytes of the wire in a message for people.
#pragma once

#include <string>
#include <string_view>

namespace rig::drivers {

/// The first 60 bytes; those that cannot be printed as "\x1b".
[[nodiscard]] std::string printable(std::string_view bytes);

}  // namespace rig::drivers
