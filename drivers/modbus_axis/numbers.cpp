#include "drivers/modbus_axis/numbers.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace rig::drivers::modbus {

using base::ErrorCode;
using base::fail;
using base::Result;

std::optional<std::int64_t> parse_whole(const std::string& text) {
  const bool negative = text.starts_with('-');
  std::string digits = text.substr(negative ? 1 : 0);
  const bool hex = digits.starts_with("0x");
  if (hex) digits.erase(0, 2);
  std::uint64_t number = 0;
  const char* end = digits.data() + digits.size();
  const auto [stopped, error] = std::from_chars(digits.data(), end, number, hex ? 16 : 10);
  if (digits.empty() || error != std::errc() || stopped != end) return std::nullopt;
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  const auto magnitude = static_cast<std::int64_t>(number);
  if (negative && magnitude > -least(WordType::i32)) return std::nullopt;
  return negative ? -magnitude : magnitude;
}

std::optional<std::string> placeholder(const std::string& text) {
  if (text.size() < 3 || text.front() != '{' || text.back() != '}') return std::nullopt;
  return text.substr(1, text.size() - 2);
}

Result<Number> parse_number(const std::string& text, const std::vector<Option>& options) {
  if (const auto name = placeholder(text)) {
    for (std::size_t i = 0; i < options.size(); ++i) {
      if (options[i].name == *name) return Number{0, i};
    }
    return fail(ErrorCode::bad_input, fmt::format("there is no option '{}'", *name));
  }
  const auto number = parse_whole(text);
  if (!number) return fail(ErrorCode::bad_input, fmt::format("'{}' is no whole number and no option", text));
  return Number{*number};
}

double Factor::value(const OptionValues& options) const {
  double factor = scale;
  if (times) factor *= static_cast<double>(options[*times]);
  if (per) factor /= static_cast<double>(options[*per]);
  return factor;
}

bool is_place(Quantity quantity) {
  return quantity == Quantity::position || quantity == Quantity::soft_low || quantity == Quantity::soft_high;
}

Result<std::int64_t> to_drive(const Value& value, double quantity, const OptionValues& options) {
  const double factor = value.factor.value(options);
  const double exact = value.inverse ? factor / quantity : quantity * factor;
  const auto low = static_cast<double>(value.low), high = static_cast<double>(value.high);
  const double number = rounded(exact, value.round);
  if (std::isnan(number) || (is_place(value.of) && (number < low || number > high))) {
    return fail(ErrorCode::bad_input, fmt::format("'{}' would be {}, outside {} to {} of the drive",
                                                  value.name, exact, value.low, value.high));
  }
  return static_cast<std::int64_t>(std::clamp(number, low, high));
}

}  // namespace rig::drivers::modbus
