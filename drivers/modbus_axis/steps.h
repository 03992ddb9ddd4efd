// Sequences of register writes with placeholders: what a profile has a drive do.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/result.h"
#include "drivers/modbus_axis/numbers.h"

namespace rig::drivers::modbus {

/// One request that writes words from an address on.
struct Write {
  std::uint16_t address = 0;
  std::vector<std::uint16_t> words;
};

/// "0x6200 = {mode} {position} {velocity_rpm} 0 0": written by one request, so that nothing acts on half of
/// it. A plain number is one word, an option or a value as many as its type has.
struct Step {
  struct OptionOf {
    std::size_t option;
  };
  struct ValueOf {
    std::size_t value;
  };
  using Item = std::variant<std::uint16_t, OptionOf, ValueOf>;

  std::uint16_t address = 0;
  std::vector<Item> items;
};

/// `known`: of which quantities values may be used here.
[[nodiscard]] base::Result<Step> parse_step(const std::string& text, const std::vector<Option>& options,
                                            const std::vector<Value>& values,
                                            const std::vector<Quantity>& known);

/// The quantities of one command, indexed by Quantity; those that it does not give are NaN.
struct Quantities {
  Quantities();
  double& operator[](Quantity quantity) { return of[static_cast<std::size_t>(quantity)]; }
  double operator[](Quantity quantity) const { return of[static_cast<std::size_t>(quantity)]; }
  std::array<double, 7> of;
};

/// A step with its numbers in place.
[[nodiscard]] base::Result<Write> fill_in(const Step& step, const std::vector<Option>& options,
                                          const OptionValues& option_values, const std::vector<Value>& values,
                                          const Quantities& quantities);

}  // namespace rig::drivers::modbus
