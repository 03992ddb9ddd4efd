// Whatever the settings of the virtual rig's module hold: they are read, or every mistake in them is told in
// words.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "sim/world.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto table = rig::base::ConfigTable::parse(text, "rig.toml");
  if (!table) {
    if (table.error().what.empty()) std::abort();
    return 0;
  }
  (void)rig::sim::read_world(*table);
  const auto read = table->noted();
  if (!read && read.error().what.empty()) std::abort();
  return 0;
}
