// The numbers of a profile: options that an axis may set, and the conversions between what rigd asks for and
// what stands in a drive's registers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "drivers/common/rounding.h"
#include "drivers/modbus_axis/words.h"

namespace rig::drivers::modbus {

/// A number that the drive's owner chooses: [option.NAME] of a profile, `drive.NAME` of an axis.
struct Option {
  std::string name;
  Format format;
  std::int64_t fallback = 0, low = 0, high = 0;
};

/// The options of one axis, in the order of its profile's.
using OptionValues = std::vector<std::int64_t>;

/// A number written out in a profile, or an option.
struct Number {
  std::int64_t literal = 0;
  std::optional<std::size_t> option = std::nullopt;  ///< index; then the literal says nothing

  [[nodiscard]] std::int64_t value(const OptionValues& options) const {
    return option ? options[*option] : literal;
  }
};

/// "17", "-3" or "0x11"; nothing where it is no whole number of 32 bits, with or without sign.
[[nodiscard]] std::optional<std::int64_t> parse_whole(const std::string& text);
/// As parse_whole, or "{NAME}" of an option.
[[nodiscard]] base::Result<Number> parse_number(const std::string& text, const std::vector<Option>& options);
/// The name in "{NAME}"; nothing where the text is not of that form.
[[nodiscard]] std::optional<std::string> placeholder(const std::string& text);

/// scale x option `times` / option `per`.
struct Factor {
  double scale = 1;
  std::optional<std::size_t> times = std::nullopt, per = std::nullopt;  ///< options, none of them ever 0

  [[nodiscard]] double value(const OptionValues& options) const;
};

/// What rigd or the settings give, in counts, counts/s or counts/s^2 of the axis.
enum class Quantity {
  position,
  velocity,
  acceleration,
  max_velocity,
  max_acceleration,
  soft_low,
  soft_high,
};

[[nodiscard]] bool is_place(Quantity quantity);

/// How a quantity is written in the drive's own unit: [value.NAME] of a profile. The register holds
/// quantity x factor, with `inverse` factor / quantity (a time per speed).
struct Value {
  std::string name;
  Quantity of = Quantity::position;
  Format format;
  Factor factor;
  bool inverse = false;
  Rounding round = Rounding::nearest;
  std::int64_t low = 0, high = 0;  ///< what the drive takes
};

/// The number for the register, rounded as `value.round` says; a number that is whole but for the last bits
/// of its conversion is that number. A place beyond low and high is bad_input; of speeds and accelerations
/// the nearest that the drive takes is taken.
[[nodiscard]] base::Result<std::int64_t> to_drive(const Value& value, double quantity,
                                                  const OptionValues& options);

}  // namespace rig::drivers::modbus
