// Whatever the virtual rig's file of faults holds: it is read, or every mistake in it is told in words.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "sim/fault_plan.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto table = rig::base::ConfigTable::parse(text, "faults.toml");
  if (!table) {
    if (table.error().what.empty()) std::abort();
    return 0;
  }
  const auto plan = rig::sim::read_fault_plan(*table);
  const auto read = table->finish();
  if (!read && read.error().what.empty()) std::abort();
  // What was read without a mistake names a span of time and a chance that can be used.
  for (const auto& fault : plan.faults) {
    if (read && !(fault.chance >= 0 && fault.chance <= 1 && fault.from_s <= fault.until_s)) std::abort();
  }
  return 0;
}
