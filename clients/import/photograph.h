// One photograph as linear values on the texels of a map.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/maps/observation_map.h"

namespace rig::import {

/// How the numbers in a file follow from the light: linearly, by sRGB's transfer function, or by a power
/// (value = light^(1/exponent)).
struct Encoding {
  enum class Kind { linear, srgb, power } kind = Kind::srgb;
  double exponent = 2.2;  ///< of `power`
};
/// "linear", "srgb", "gamma:2.2". An Error lists them.
[[nodiscard]] base::Result<Encoding> parse_encoding(const std::string& text);
[[nodiscard]] std::string text_of(const Encoding& encoding);
/// Light of a code in [0, 1], and its slope.
[[nodiscard]] double decoded(const Encoding& encoding, double code);
[[nodiscard]] double decoded_slope(const Encoding& encoding, double code);

struct ImageSize {
  int width = 0, height = 0;
  int bits = 8;  ///< of a sample as stored
};
[[nodiscard]] base::Result<ImageSize> image_size(const std::filesystem::path& file);

/// Linear light on a grid of texels: row 0 is the bottom of the picture, index (t * columns + s) * 3 + c.
struct TexelImage {
  std::vector<float> value;
  std::vector<float> variance;           ///< of the rounding to whole codes
  std::vector<maps::Validity> validity;  ///< good, saturated or dark, one a texel
};

/// Rows [first_row, first_row + rows) of the photograph on columns x all_rows texels, each the mean of its
/// area. A texel is saturated if a pixel of it is at the top of the range, and dark if all are at the bottom.
/// Grey images give three equal channels.
[[nodiscard]] base::Result<TexelImage> read_texels(const std::filesystem::path& file,
                                                   const Encoding& encoding, int columns, int all_rows,
                                                   int first_row, int rows);

}  // namespace rig::import
