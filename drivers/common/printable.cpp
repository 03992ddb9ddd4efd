#include "drivers/common/printable.h"

#include <cctype>
#include <fmt/format.h>

namespace rig::drivers {

std::string printable(std::string_view bytes) {
  constexpr std::size_t kShown = 60;
  std::string out;
  for (const char c : bytes.substr(0, kShown)) {
    out += std::isprint(static_cast<unsigned char>(c)) != 0
               ? std::string(1, c)
               : fmt::format(R"(\x{:02x})", static_cast<unsigned char>(c));
  }
  return bytes.size() > kShown ? out + "..." : out;
}

}  // namespace rig::drivers
