#include "clients/import/photograph.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/base/srgb.h"

// Last: it defines macros that hide the byte swaps of the system.
#include <OpenImageIO/imageio.h>

namespace rig::import {

namespace fs = std::filesystem;
using base::ErrorCode;
using base::fail;
using base::Result;
using maps::Validity;

namespace {

std::string reason(const std::unique_ptr<OIIO::ImageInput>& in) {
  const std::string text = in ? in->geterror() : OIIO::geterror();
  return text.empty() ? "OpenImageIO cannot read it" : text;
}

// The part of the pixel axis that a texel covers, as pixels with their shares.
struct Cover {
  int first = 0;
  std::vector<double> share;
};
Cover cover(int texel, int texels, int pixels) {
  const double begin = static_cast<double>(texel) * pixels / texels;
  const double end = static_cast<double>(texel + 1) * pixels / texels;
  Cover c{std::min(static_cast<int>(begin), pixels - 1), {}};
  for (int p = c.first; p < pixels && p < end; ++p) {
    c.share.push_back((std::min<double>(p + 1, end) - std::max<double>(p, begin)) / (end - begin));
  }
  return c;
}

}  // namespace

Result<Encoding> parse_encoding(const std::string& text) {
  if (text == "linear") return Encoding{Encoding::Kind::linear, 1};
  if (text == "srgb") return Encoding{Encoding::Kind::srgb, 2.2};
  if (text.rfind("gamma:", 0) == 0) {
    Encoding encoding{Encoding::Kind::power, 0};
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + 6, end, encoding.exponent);
    if (error == std::errc() && stop == end && encoding.exponent > 0.2 && encoding.exponent < 5)
      return encoding;
  }
  return fail(ErrorCode::bad_input, fmt::format("'{}' is no encoding", text), "--encoding",
              "linear, srgb, or gamma: and an exponent between 0.2 and 5, like gamma:2.2");
}

std::string text_of(const Encoding& encoding) {
  switch (encoding.kind) {
    case Encoding::Kind::linear:
      return "linear";
    case Encoding::Kind::srgb:
      return "srgb";
    case Encoding::Kind::power:
      return fmt::format("gamma:{}", encoding.exponent);
  }
  return {};
}

double decoded(const Encoding& encoding, double code) {
  switch (encoding.kind) {
    case Encoding::Kind::linear:
      return code;
    case Encoding::Kind::srgb:
      return base::linear_from_srgb(code);
    case Encoding::Kind::power:
      return std::pow(std::max(code, 0.0), encoding.exponent);
  }
  return code;
}

double decoded_slope(const Encoding& encoding, double code) {
  switch (encoding.kind) {
    case Encoding::Kind::linear:
      return 1;
    case Encoding::Kind::srgb:
      return code <= 0.04045 ? 1 / 12.92 : 2.4 / 1.055 * std::pow((code + 0.055) / 1.055, 1.4);
    case Encoding::Kind::power:
      return encoding.exponent * std::pow(std::max(code, 0.0), encoding.exponent - 1);
  }
  return 1;
}

Result<ImageSize> image_size(const fs::path& file) {
  if (!fs::exists(file)) return fail(ErrorCode::not_found, "does not exist", file.string());
  const auto in = OIIO::ImageInput::open(file.string());
  if (!in) return fail(ErrorCode::damaged, reason(in), file.string(), "is it an image?");
  const OIIO::ImageSpec& spec = in->spec();
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) {
    return fail(ErrorCode::damaged, "has no pixels", file.string());
  }
  return ImageSize{spec.width, spec.height, static_cast<int>(8 * spec.format.basesize())};
}

Result<TexelImage> read_texels(const fs::path& file, const Encoding& encoding, int columns, int all_rows,
                               int first_row, int rows) {
  const auto in = OIIO::ImageInput::open(file.string());
  if (!in) return fail(ErrorCode::damaged, reason(in), file.string());
  const OIIO::ImageSpec spec = in->spec();
  const bool whole_codes = !spec.format.is_floating_point();
  const double top = whole_codes ? 1.0 : INFINITY;
  const double step =
      whole_codes ? 1 / (std::pow(2.0, 8.0 * static_cast<double>(spec.format.basesize())) - 1) : 0;
  const int channels = std::min(spec.nchannels, 3);
  const auto width = static_cast<std::size_t>(spec.width);
  std::vector<float> codes(width * static_cast<std::size_t>(spec.height) *
                           static_cast<std::size_t>(channels));
  if (!in->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, codes.data())) {
    return fail(ErrorCode::damaged, reason(in), file.string());
  }
  const auto code_at = [&](int y, int x, std::size_t c) {
    const std::size_t pixel = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
    const auto of = static_cast<std::size_t>(channels);
    return static_cast<double>(codes[pixel * of + (c < of ? c : 0)]);
  };
  TexelImage out;
  for (int t = first_row; t < first_row + rows; ++t) {
    const Cover down = cover(all_rows - 1 - t, all_rows, spec.height);
    for (int s = 0; s < columns; ++s) {
      const Cover along = cover(s, columns, spec.width);
      bool saturated = false;
      bool lit = false;
      for (std::size_t c = 0; c < 3; ++c) {
        double value = 0;
        double variance = 0;
        for (std::size_t j = 0; j < down.share.size(); ++j) {
          for (std::size_t i = 0; i < along.share.size(); ++i) {
            const double code =
                code_at(down.first + static_cast<int>(j), along.first + static_cast<int>(i), c);
            if (!std::isfinite(code))
              return fail(ErrorCode::damaged, "holds values that are no numbers", file.string());
            const double share = down.share[j] * along.share[i];
            // Rounding errors are uniform over one code, and independent from pixel to pixel.
            const double sigma = share * decoded_slope(encoding, code) * step;
            value += share * decoded(encoding, code);
            variance += sigma * sigma / 12;
            saturated = saturated || code > top - 1.5 * step;
            lit = lit || code > 1.5 * step;
          }
        }
        out.value.push_back(static_cast<float>(value));
        out.variance.push_back(static_cast<float>(variance));
      }
      out.validity.push_back(saturated ? Validity::saturated : lit ? Validity::good : Validity::dark);
    }
  }
  return out;
}

}  // namespace rig::import
