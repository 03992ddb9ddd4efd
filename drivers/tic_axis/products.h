// The kinds of Tic, and in what they differ: currents and step modes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace rig::drivers::tic {

inline constexpr std::uint16_t kPololu = 0x1FFB;  ///< idVendor

/// By idProduct.
enum class Product : std::uint16_t {
  t825 = 0x00B3,
  t834 = 0x00B5,
  t500 = 0x00BD,
  n825 = 0x00C3,
  t249 = 0x00C9,
  v36 = 0x00CB,  ///< 36v4
};

[[nodiscard]] std::optional<Product> product_of(std::uint16_t id);
[[nodiscard]] const char* name_of(Product product);  ///< "Tic T825"

/// The current in mA that a code of the current limit really sets; codes above the greatest are as that.
[[nodiscard]] int current_ma(Product product, std::uint8_t code);
/// The code with the greatest current that is not above `ma`, as the Tic's own tool chooses it.
[[nodiscard]] std::uint8_t current_code(Product product, int ma);
[[nodiscard]] int most_current_ma(Product product);

/// Microsteps of a full step, 1 to 256; nothing for a code that no Tic has.
[[nodiscard]] std::optional<int> microsteps(std::uint8_t step_mode);
/// The step mode with so many microsteps; nothing where this Tic has none.
[[nodiscard]] std::optional<std::uint8_t> step_mode_code(Product product, int microsteps);

}  // namespace rig::drivers::tic
