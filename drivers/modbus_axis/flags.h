// What a bit, or a number, in a drive's registers means: the flags of a profile's [state].
#pragma once

#include <string>
#include <vector>

#include "core/base/result.h"
#include "drivers/modbus_axis/numbers.h"

namespace rig::drivers::modbus {

/// "never", "always", "remembered", or a test of one register:
///   REGISTER & MASK            any of these bits is 1
///   REGISTER & MASK == NUMBER  these bits are as in the number; also !=
///   REGISTER == NUMBER         also !=
///   not TEST                   the opposite
/// MASK and NUMBER may be options: {NAME}. A mask that is 0 says that the drive does not tell: never true.
struct Flag {
  enum class Kind {
    never,
    always,
    remembered,  ///< the drive does not tell; the driver remembers what it did
    test,
  };
  Kind kind = Kind::never;
  std::size_t of_register = 0;  ///< index
  bool masked = false;
  Number mask;
  enum class Compare { any, equal, unequal } compare = Compare::any;
  Number number;
  bool opposite = false;
};

[[nodiscard]] base::Result<Flag> parse_flag(const std::string& text,
                                            const std::vector<std::string>& registers,
                                            const std::vector<Option>& options);

/// Whether the drive tells it at all.
[[nodiscard]] bool is_told(const Flag& flag, const OptionValues& options);

/// `raw` is what stands in the flag's register.
[[nodiscard]] bool holds(const Flag& flag, std::int64_t raw, const OptionValues& options);

}  // namespace rig::drivers::modbus
