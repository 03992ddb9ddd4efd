#include "core/geometry/sensor.h"

#include <array>
#include <utility>

namespace rig::geometry {

namespace {

constexpr std::array<std::pair<BayerPattern, const char*>, 5> kNames{{{BayerPattern::none, "none"},
                                                                      {BayerPattern::rggb, "RGGB"},
                                                                      {BayerPattern::bggr, "BGGR"},
                                                                      {BayerPattern::grbg, "GRBG"},
                                                                      {BayerPattern::gbrg, "GBRG"}}};

}  // namespace

std::string text_from_bayer(BayerPattern pattern) {
  for (const auto& [value, name] : kNames) {
    if (value == pattern) return name;
  }
  return "none";
}

base::Result<BayerPattern> bayer_from_text(const std::string& text) {
  for (const auto& [value, name] : kNames) {
    if (text == name) return value;
  }
  return base::fail(base::ErrorCode::bad_input, fmt::format("'{}' is no Bayer pattern", text), {},
                    "one of none, RGGB, BGGR, GRBG, GBRG");
}

Colour colour_at(BayerPattern pattern, int x, int y) {
  using enum Colour;
  constexpr std::array<std::array<Colour, 4>, 5> kCells{{{green, green, green, green},
                                                         {red, green, green, blue},
                                                         {blue, green, green, red},
                                                         {green, red, blue, green},
                                                         {green, blue, red, green}}};
  return kCells[static_cast<std::size_t>(pattern)][static_cast<std::size_t>(2 * (y & 1) + (x & 1))];
}

}  // namespace rig::geometry
