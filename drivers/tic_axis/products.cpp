#include "drivers/tic_axis/products.h"

#include <algorithm>
#include <array>

namespace rig::drivers::tic {

namespace {

// The T500's currents by code (nominal values of its maker, in mA).
constexpr std::array kT500_ma{0,    1,    174,  343,  495,  634,  762,  880,  990,  1092, 1189,
                              1281, 1368, 1452, 1532, 1611, 1687, 1762, 1835, 1909, 1982, 2056,
                              2131, 2207, 2285, 2366, 2451, 2540, 2634, 2734, 2843, 2962, 3093};
// Microsteps by code. Code 6 is half steps at full current, of the T249 alone.
constexpr std::array kMicrosteps{1, 2, 4, 8, 16, 32, 2, 64, 128, 256};
constexpr std::uint8_t kHalfAtFullCurrent = 6;

std::uint8_t most_code(Product product) {
  switch (product) {
    case Product::t500:
      return 32;
    case Product::t834:
      return 108;
    case Product::t249:
      return 112;
    case Product::v36:
      return 127;
    case Product::t825:
    case Product::n825:
      return 124;
  }
  return 0;
}

int most_microsteps(Product product) {
  if (product == Product::t500) return 8;
  return product == Product::v36 ? 256 : 32;
}

}  // namespace

std::optional<Product> product_of(std::uint16_t id) {
  for (const Product each :
       {Product::t825, Product::t834, Product::t500, Product::n825, Product::t249, Product::v36}) {
    if (static_cast<std::uint16_t>(each) == id) return each;
  }
  return std::nullopt;
}

const char* name_of(Product product) {
  switch (product) {
    case Product::t825:
      return "Tic T825";
    case Product::t834:
      return "Tic T834";
    case Product::t500:
      return "Tic T500";
    case Product::n825:
      return "Tic N825";
    case Product::t249:
      return "Tic T249";
    case Product::v36:
      return "Tic 36v4";
  }
  return "Tic";
}

int current_ma(Product product, std::uint8_t code) {
  code = std::min(code, most_code(product));
  switch (product) {
    case Product::t500:
      return kT500_ma[code];
    case Product::t249: {
      constexpr int kUnit_ma = 40;
      return code * kUnit_ma;
    }
    case Product::v36: {
      // 55 A over 768 a code, rounded.
      constexpr int kPer768_ma = 55000, kHalf = 384, kCodes = 768;
      return (kPer768_ma * code + kHalf) / kCodes;
    }
    default: {
      // The driver has fewer steps where the current is greater; the Tic rounds down.
      constexpr int kUnit_ma = 32, kCoarse = 32, kCoarser = 64;
      const int step = code > kCoarser ? 4 : code > kCoarse ? 2 : 1;
      return code / step * step * kUnit_ma;
    }
  }
}

std::uint8_t current_code(Product product, int ma) {
  std::uint8_t found = 0;
  for (int code = 0; code <= most_code(product); ++code) {
    const int each = current_ma(product, static_cast<std::uint8_t>(code));
    // The first of several that set the same.
    if (each <= ma && each > current_ma(product, found)) found = static_cast<std::uint8_t>(code);
  }
  return found;
}

int most_current_ma(Product product) {
  return current_ma(product, most_code(product));
}

std::optional<int> microsteps(std::uint8_t step_mode) {
  if (step_mode >= kMicrosteps.size()) return std::nullopt;
  return kMicrosteps[step_mode];
}

std::optional<std::uint8_t> step_mode_code(Product product, int wanted) {
  if (wanted > most_microsteps(product)) return std::nullopt;
  for (std::uint8_t code = 0; code < kMicrosteps.size(); ++code) {
    if (code != kHalfAtFullCurrent && kMicrosteps[code] == wanted) return code;
  }
  return std::nullopt;
}

}  // namespace rig::drivers::tic
