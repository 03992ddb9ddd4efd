// Whatever rig.toml holds: it is read, or every mistake in it is told in words.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/machine/rig_config.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto read = rig::machine::parse_rig_config(text, "rig.toml");
  if (!read && read.error().what.empty()) std::abort();
  return 0;
}
