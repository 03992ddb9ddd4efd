// Whatever comes over the example driver's line: it is an answer, or it is told in words why not.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "share/examples/driver/protocol.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace rig::drivers::turner;
  const std::string_view line(reinterpret_cast<const char*>(data), size);
  const auto text = answer(3, line);
  if (!text && text.error().what.empty()) std::abort();
  // Also what no right sum stands behind.
  (void)report(line);
  (void)verdict('M', line);
  return 0;
}
