#include "clients/report/picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/srgb.h"

// Last: it defines macros that hide the byte swaps of the system.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace rig::report {

namespace {

std::string base64(const std::vector<unsigned char>& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = (group << 8) | (k < n ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += k <= n ? kDigits[(group >> (18 - 6 * k)) & 63] : '=';
  }
  return out;
}

}  // namespace

base::Result<std::string> data_url(const Picture& picture, double exposure) {
  std::vector<unsigned char> pixels;
  pixels.reserve(picture.rgb.size());
  for (int y = picture.rows - 1; y >= 0; --y) {
    for (int i = 0; i < 3 * picture.columns; ++i) {
      const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(3 * picture.columns) +
                      static_cast<std::size_t>(i);
      const double v = std::clamp(static_cast<double>(picture.rgb[at]) * exposure, 0.0, 1.0);
      pixels.push_back(
          static_cast<unsigned char>(std::lround(255 * base::srgb_from_linear(std::isfinite(v) ? v : 0))));
    }
  }
  std::vector<unsigned char> png;
  OIIO::Filesystem::IOVecOutput sink(png);
  auto out = OIIO::ImageOutput::create("report.png");
  OIIO::ImageSpec spec(picture.columns, picture.rows, 3, OIIO::TypeDesc::UINT8);
  if (!out || !out->set_ioproxy(&sink) || !out->open("report.png", spec) ||
      !out->write_image(OIIO::TypeDesc::UINT8, pixels.data()) || !out->close()) {
    return base::fail(base::ErrorCode::io, "OpenImageIO cannot encode a picture: " + OIIO::geterror());
  }
  return "data:image/png;base64," + base64(png);
}

Picture colour_scale(const std::vector<float>& values, int columns, int rows, double low, double high) {
  // Five stations of a scale that grows evenly in lightness.
  constexpr std::array<std::array<double, 3>, 5> kStations{
      {{0.27, 0.00, 0.33}, {0.23, 0.32, 0.55}, {0.13, 0.57, 0.55}, {0.37, 0.79, 0.38}, {0.99, 0.91, 0.14}}};
  Picture picture{columns, rows, {}};
  picture.rgb.reserve(values.size() * 3);
  for (const float value : values) {
    const double share =
        high > low ? std::clamp((static_cast<double>(value) - low) / (high - low), 0.0, 1.0) : 0;
    const double at = 4 * (std::isfinite(share) ? share : 0);
    const auto i = std::min<std::size_t>(3, static_cast<std::size_t>(at));
    const double f = at - static_cast<double>(i);
    for (std::size_t c = 0; c < 3; ++c) {
      picture.rgb.push_back(
          static_cast<float>(base::linear_from_srgb((1 - f) * kStations[i][c] + f * kStations[i + 1][c])));
    }
  }
  return picture;
}

double percentile(std::vector<float> values, double share) {
  values.erase(std::remove_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); }),
               values.end());
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

}  // namespace rig::report
