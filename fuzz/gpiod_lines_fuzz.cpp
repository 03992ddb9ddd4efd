// Whatever a socket answers in the place of a gpiochip, and whatever changes a line is said to have made: an
// active moment is not missed.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/gpiod_lines/input_filter.h"
#include "drivers/gpiod_lines/socket_chip.h"

using namespace rig::drivers::gpiod_lines;

// The first byte: a debounce; the second: the level behind the changes.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::int64_t debounce_ns = data[0];
  const bool level = data[1] % 2 == 1;
  const std::string_view answer(reinterpret_cast<const char*>(data) + 2, size - 2);
  const auto said = read_answer(answer);
  if (!said) {
    if (said.error().what.empty()) std::abort();
    return 0;
  }
  (void)read_level(*said);
  (void)read_offset(*said);
  const auto edges = read_edges(*said);
  if (!edges) return 0;
  if (edges->size() > 4 * kEdgeQueue) std::abort();

  InputFilter filter(debounce_ns);
  if (filter.look({}, false, 0)) std::abort();
  bool active = level;
  for (const Edge& edge : *edges) active = active || edge.active;
  const bool seen = filter.look(*edges, level, std::int64_t{1} << 62U);
  const bool must = edges->size() >= kEdgeQueue || (debounce_ns == 0 && active);
  if (must && !seen) std::abort();
  if (edges->empty() && !level && seen) std::abort();
  return 0;
}
