#include "sim/wire/cp2112_orders.h"

#include <optional>
#include <sstream>

namespace rig::sim::wire {

using base::ErrorCode;
using base::fail;
using base::Result;

Result<std::string> carry_out_order(Cp2112& chip, std::string_view order) {
  std::istringstream words{std::string(order)};
  std::string what, level;
  int number = -1;
  words >> what >> number;
  const bool whole = !words.fail();
  words >> level;
  const auto wrong = [&](const char* hint) {
    return fail(ErrorCode::bad_input, fmt::format("'{}' is no order", order), "cp2112", hint);
  };
  if (what == "stall") {
    if (!whole || number < 0) return wrong("stall COUNT");
    chip.stall_next(number);
    return std::string();
  }
  const bool is_pin = whole && number >= 0 && number < static_cast<int>(Cp2112::kPins);
  const auto pin = static_cast<unsigned int>(number);
  if (what == "show") {
    if (!is_pin) return wrong("show PIN");
    return fmt::format("{} {}", chip.is_output(pin) ? "output" : "input", chip.high(pin) ? "high" : "low");
  }
  const bool is_level = level == "high" || level == "low" || level == "free";
  if (what != "drive" || !is_pin || !is_level) return wrong("drive PIN high|low|free, show PIN, stall COUNT");
  chip.drive(pin, level == "free" ? std::nullopt : std::optional(level == "high"));
  return std::string();
}

}  // namespace rig::sim::wire
